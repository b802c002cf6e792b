"""Prints the licences of all that is part of what is shipped: licences.py PART...

A PART is a program, PACKAGE:TARGET:MANIFEST, whose crates are named with their texts, or TITLE=FILE, a text by itself. Ends
with 1 where a crate has no licence, or one that is not taken into what is shipped.
"""

import json
import os
import re
import subprocess
import sys

FREE = {
    "0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "CC0-1.0",
    "ISC", "MIT", "MIT-0", "MPL-2.0", "Unicode-3.0", "Unlicense", "Zlib",
}  # fmt: skip


def is_free(expression):
    """Whether an SPDX expression can be met with the licences above."""
    alternatives = re.split(r"\s+OR\s+|/", expression)
    if "(" in expression:
        # One level of brackets: every part in or outside them that is joined by AND.
        return all(is_free(part.strip("() ")) for part in re.split(r"\s+AND\s+(?![^(]*\))", expression))
    return any(all(one.strip() in FREE for one in re.split(r"\s+AND\s+", each)) for each in alternatives)


def shipped(program):
    """The packages that end up in a program: what it depends on, tests and build scripts left out."""
    name, target, manifest = program.split(":")
    asked = f"cargo metadata --locked --format-version 1 --filter-platform {target} --manifest-path {manifest}"
    found = json.loads(subprocess.run(asked.split(), check=True, stdout=subprocess.PIPE).stdout)
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    packages = {package["id"]: package for package in found["packages"]}
    waiting = [p["id"] for p in found["packages"] if p["name"] == name and p["source"] is None]
    assert waiting, f"{manifest} has no {name}"
    seen = set()
    while waiting:
        one = waiting.pop()
        if one in seen:
            continue
        seen.add(one)
        for dependency in nodes[one]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    return [packages[one] for one in seen if packages[one]["source"] is not None]


def texts(package):
    folder = os.path.dirname(package["manifest_path"])
    names = [n for n in sorted(os.listdir(folder)) if re.match(r"(?i)(licen[cs]e|copying|notice|unlicense)", n)]
    files = [os.path.join(folder, name) for name in names]
    return [open(file, encoding="utf-8", errors="replace").read().strip() for file in files if os.path.isfile(file)]


def main():
    files = dict(part.split("=", 1) for part in sys.argv[1:] if "=" in part)
    found = [package for part in sys.argv[1:] if "=" not in part for package in shipped(part)]
    packages = list({(p["name"], p["version"]): p for p in sorted(found, key=lambda p: p["id"])}.values())
    refused = [f"{p['name']} {p['version']}: {p['license']}" for p in packages if not is_free(p["license"] or "")]
    if refused:
        sys.exit("tests/dist/licences.py: not to be shipped:\n  " + "\n  ".join(refused))
    print("yawrig is under the MIT licence or the Apache licence 2.0, at your choice: LICENSE-MIT, LICENSE-APACHE.")
    print(f"Part of it are {len(packages)} crates of others, Rust's own library (MIT or Apache-2.0), and what follows them.\n")
    by_text, names_of = {}, {}
    for package in packages:
        name = f"{package['name']} {package['version']}"
        found = texts(package)
        without = "" if found else "  (by that name only: its authors give no text)"
        print(f"  {name:40} {package['license']}{without}")
        for text in found:
            # One text, however its lines are broken.
            same = " ".join(text.split())
            by_text.setdefault(same, text)
            names_of.setdefault(same, []).append(name)
    sections = [(", ".join(dict.fromkeys(names_of[same])), text) for same, text in by_text.items()]
    sections += [(title, open(file, encoding="utf-8").read().strip()) for title, file in files.items()]
    for title, text in sections:
        print("\n" + "-" * 78 + "\n" + title + "\n\n" + text)


main()

"""Packs FOLDER so that the same files give the same bytes: pack.py FOLDER OUT.tar.gz|OUT.zip SECONDS

SECONDS since 1970 is the time of everything in it. Owners, order and rights are not those of this machine.
"""

import gzip
import os
import sys
import tarfile
import time
import zipfile


def files(folder):
    """Path on this machine and name in the archive, in a fixed order."""
    top = os.path.basename(folder)
    for place, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = os.path.join(place, name)
            yield path, os.path.join(top, os.path.relpath(path, folder))


def mode(path):
    return 0o755 if os.access(path, os.X_OK) else 0o644


def tar(folder, out, seconds):
    with open(out, "wb") as raw, gzip.GzipFile("", "wb", 9, raw, mtime=seconds) as packed:
        with tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive:
            for path, name in files(folder):
                about = tarfile.TarInfo(name)
                about.size, about.mtime, about.mode = os.path.getsize(path), seconds, mode(path)
                with open(path, "rb") as file:
                    archive.addfile(about, file)


def zipped(folder, out, seconds):
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for path, name in files(folder):
            about = zipfile.ZipInfo(name.replace(os.sep, "/"), time.gmtime(seconds)[:6])
            about.compress_type, about.external_attr = zipfile.ZIP_DEFLATED, mode(path) << 16
            about.create_system = 3
            with open(path, "rb") as file:
                archive.writestr(about, file.read())


def main():
    folder, out, seconds = sys.argv[1:]
    (zipped if out.endswith(".zip") else tar)(folder.rstrip("/"), out, int(seconds))


main()

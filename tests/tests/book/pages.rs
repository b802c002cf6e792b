//! The README and the pages of the book, and the blocks in them.

use std::path::{Path, PathBuf};

/// The project's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests lie in the project").to_owned()
}

/// One page.
pub struct Page {
    /// From the project's folder.
    pub path: PathBuf,
    pub text: String,
}

/// Something on a page that is to be tried, in its order.
#[derive(Debug, PartialEq)]
pub enum Step {
    /// A line of an `sh` block.
    Run(String),
    /// The end of an `sh` block.
    Ran,
    /// Lines of a `text output` block: what the commands of the block above it print, and more.
    Prints(Vec<String>),
    /// A `python` block.
    Python(String),
    /// A name in a table whose first column is `field`: what the JSON of the last command holds.
    Field(String),
    /// A line of an `sh hardware` block.
    Hardware(String),
    /// A `toml` block with a name: a file that is there from the page's beginning.
    File(String, String),
}

impl Page {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(root().join(path));
        let text = text.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self { path: path.to_owned(), text }
    }

    /// What is to be tried on it.
    ///
    /// # Panics
    /// At a block of a kind that nobody knows: it would be left out without a word.
    pub fn steps(&self) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut block: Option<(&str, Vec<&str>)> = None;
        let mut in_fields = false;
        for line in self.text.lines() {
            match (&mut block, line.strip_prefix("```")) {
                (Some((kind, lines)), Some("")) => {
                    self.end_block(kind, lines, &mut steps);
                    block = None;
                }
                (Some((_, lines)), _) => lines.push(line),
                (None, Some(kind)) => block = Some((kind, Vec::new())),
                (None, None) if line.starts_with("| field |") => in_fields = true,
                (None, None) if !line.starts_with('|') => in_fields = false,
                (None, None) if in_fields => steps.extend(fields(line).map(Step::Field)),
                (None, None) => {}
            }
        }
        assert!(block.is_none(), "{}: a block without an end", self.path.display());
        steps
    }

    fn end_block(&self, kind: &str, lines: &[&str], steps: &mut Vec<Step>) {
        let owned = || lines.iter().map(|line| (*line).to_owned());
        match kind {
            "sh" => {
                steps.extend(owned().map(Step::Run));
                steps.push(Step::Ran);
            }
            "text output" => steps.push(Step::Prints(owned().collect())),
            "python" => steps.push(Step::Python(lines.join("\n"))),
            "sh hardware" => steps.extend(owned().map(Step::Hardware)),
            // Of the Python package, whose tests run them (tests/python).
            "text" | "toml" | "python package" => {}
            _ => match kind.strip_prefix("toml ") {
                Some(name) => steps.push(Step::File(name.to_owned(), lines.join("\n"))),
                None => panic!("{}: a block of kind {kind:?}", self.path.display()),
            },
        }
    }
}

/// The names between backticks in the first column of a row; those after the first may leave out what is the
/// same.
fn fields(row: &str) -> impl Iterator<Item = String> + '_ {
    let column = row.split('|').nth(1).unwrap_or("");
    let names = || column.split('`').skip(1).step_by(2);
    let beside = names().next().and_then(|first| first.rsplit_once('.')).map(|(parent, _)| parent);
    names().map(move |name| match beside {
        Some(parent) if !name.contains('.') => format!("{parent}.{name}"),
        _ => name.to_owned(),
    })
}

/// The README and all pages that the book's summary lists.
pub fn pages() -> Vec<Page> {
    let listed = listed(&root()).into_iter().map(|page| Path::new("docs/src").join(page));
    let paths = std::iter::once(PathBuf::from("README.md")).chain(listed);
    paths.map(|path| Page::read(&path)).collect()
}

/// The pages of the summary of `root`'s book, from the folder of the summary on.
pub fn listed(root: &Path) -> Vec<PathBuf> {
    let summary = std::fs::read_to_string(root.join("docs/src/SUMMARY.md")).expect("a summary");
    let links = summary.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    links.map(|(link, _)| PathBuf::from(link)).collect()
}

#[test]
fn steps_come_in_the_order_of_a_page() {
    let text = "```toml a.toml\nx = 1\n```\n```sh\na b\nc\n```\n```text output\no 1\n```\n| field | what |\n|---|---|\n\
                | `a.b`, `c`, `d.e` | `f` |\n\n| key |\n| `d` |\n```python\nprint(1)  # 1\n```\n```text\nno\n```\n";
    let page = Page { path: "p.md".into(), text: text.to_owned() };
    let [run, field] = [Step::Run, Step::Field];
    let expected = [
        Step::File("a.toml".into(), "x = 1".into()),
        run("a b".into()),
        run("c".into()),
        Step::Ran,
        Step::Prints(vec!["o 1".into()]),
        field("a.b".into()),
        field("a.c".into()),
        field("d.e".into()),
        Step::Python("print(1)  # 1".into()),
    ];
    assert_eq!(page.steps(), expected);
}

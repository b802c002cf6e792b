//! What a command has said by its end.

use serde_json::Value;

/// A command that has ended.
#[derive(Debug)]
pub struct Ended {
    /// Exit code; a signal's number below zero where one ended it.
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
    pub(crate) line: String,
}

impl Ended {
    /// # Panics
    /// Where it ended with another exit code, or a thread of it panicked.
    #[track_caller]
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, code, "exit code of {}", self.report());
        assert!(!self.stderr.contains("panicked"), "{}", self.report());
        self
    }

    /// # Panics
    /// Where these words are not on its stderr.
    #[track_caller]
    pub fn says(self, words: &str) -> Self {
        assert!(self.stderr.contains(words), "{words:?} is missing from {}", self.report());
        self
    }

    /// # Panics
    /// Where these words are not on its stderr one after the other.
    #[track_caller]
    pub fn says_in_order(&self, all: &[&str]) {
        let mut left = self.stderr.as_str();
        for words in all {
            let at = left.find(words);
            let at = at.unwrap_or_else(|| panic!("{words:?} is missing from {}", self.report()));
            left = &left[at + words.len()..];
        }
    }

    /// # Panics
    /// Where its message has no line that tells the user what to do.
    #[track_caller]
    pub fn helps(self) -> Self {
        self.says("\n  help: ")
    }

    /// The one JSON object on its stdout.
    ///
    /// # Panics
    /// Where that is not what stdout holds.
    #[track_caller]
    pub fn json(&self) -> Value {
        let object: Value = serde_json::from_str(&self.stdout)
            .unwrap_or_else(|e| panic!("not one JSON value: {e}; {}", self.report()));
        assert!(object.is_object(), "{}", self.report());
        assert_eq!(object["schema_version"], 1, "{}", self.report());
        object
    }

    /// The JSON objects on its stdout, one a line.
    #[track_caller]
    pub fn json_lines(&self) -> Vec<Value> {
        let parse = |line: &str| {
            serde_json::from_str(line)
                .unwrap_or_else(|e| panic!("not JSON: {line:?}: {e}; {}", self.report()))
        };
        self.stdout.lines().map(parse).collect()
    }

    pub fn report(&self) -> String {
        format!("{}\n-- stdout\n{}\n-- stderr\n{}", self.line, self.stdout, self.stderr)
    }
}

//! Doubts about a campaign with their place in its file, and as they are said.

use super::CampaignFile;
use yawrig_base::error::Error;
use yawrig_core::derivatives::plausible::Doubt;

/// `doubts` with the file and the line of what they are about.
pub fn placed(file: &CampaignFile, doubts: Vec<Doubt>) -> Vec<Doubt> {
    let place = |doubt: Doubt| {
        let line = match (doubt.release, &doubt.field) {
            (Some(index), field) => file.line_in_release(index, field.as_deref()),
            (None, Some(field)) => file.line_of_entry(field),
            (None, None) => None,
        };
        Doubt { file: Some(file.path.display().to_string()), line, ..doubt }
    };
    doubts.into_iter().map(place).collect()
}

/// A doubt as a line to read.
pub fn line(doubt: &Doubt) -> String {
    let place = match (&doubt.file, doubt.line) {
        (Some(file), Some(line)) => format!("{file}, line {line}: "),
        (Some(file), None) => format!("{file}: "),
        _ => String::new(),
    };
    format!("{place}{} [{}]", doubt.message, doubt.kind.name())
}

/// Those that are open, each in a line; then how many were seen before.
pub fn lines(doubts: &[Doubt]) -> Vec<String> {
    let open = || doubts.iter().filter(|doubt| !doubt.accepted);
    let mut lines: Vec<String> = Vec::new();
    match open().count() {
        0 => {}
        1 => lines.push("One doubt, before any number:".to_owned()),
        n => lines.push(format!("{n} doubts, before any number:")),
    }
    lines.extend(open().map(|doubt| format!("  {}", line(doubt))));
    lines.extend(open().next().map(|doubt| {
        format!(
            "  (looked into and right all the same? accept = [\"{}\"] in its release)",
            doubt.kind.name()
        )
    }));
    let accepted: Vec<String> =
        doubts.iter().filter(|doubt| doubt.accepted).map(|doubt| doubt.kind.name()).collect();
    if !accepted.is_empty() {
        lines.push(format!("Doubts accepted in the file: {}", accepted.join(", ")));
    }
    lines
}

/// The error that these doubts are, if one of them refuses the campaign.
pub fn refusal(doubts: &[Doubt]) -> Option<Error> {
    let errors: Vec<String> = doubts.iter().filter(|d| d.is_error).map(line).collect();
    let doubted = doubts.iter().filter(|d| !d.is_error && !d.accepted).map(line);
    let also: Vec<String> = doubted.map(|line| format!("\n  also doubtful: {line}")).collect();
    (!errors.is_empty()).then(|| {
        Error::data(format!("{}{}", errors.join("\n  "), also.concat()))
            .help("correct the entry or the record: lengths in m, stiffness in N/m, speeds in m/s")
    })
}

//! A sweep: readings of a sensor beside the angles that a reference has.

use std::path::Path;
use yawrig_base::error::{Error, Result};

/// What was read, and where the model was.
const COLUMNS: [&str; 2] = ["yaw_deg", "reference_deg"];
const HELP: &str =
    "give a CSV file with the columns yaw_deg, what the device reads, and reference_deg, where the model is";

/// Reading and angle of each row, deg: columns `yaw_deg` and `reference_deg`, whatever is beside them.
///
/// # Errors
/// Exit 3, naming file and line: no such file or columns, no row, a cell that is no number.
pub fn read_sweep(file: &Path) -> Result<Vec<[f64; 2]>> {
    let name = file.display();
    let unreadable = |e: csv::Error| Error::data(format!("cannot read {name}: {e}")).help(HELP);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(file).map_err(unreadable)?;
    let header = reader.headers().map_err(unreadable)?.clone();
    let place = |wanted: &str| {
        let found =
            header.iter().position(|column| column.trim_start_matches('\u{feff}') == wanted);
        found.ok_or_else(|| Error::data(format!("{name}, line 1: no column {wanted}")).help(HELP))
    };
    let [yaw, reference] = COLUMNS.map(place);
    let (yaw, reference) = (yaw?, reference?);
    let mut points = Vec::new();
    for row in reader.records() {
        let row = row.map_err(unreadable)?;
        let number = |at: usize| {
            let number = row[at].parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| {
                let line = row.position().map_or(0, csv::Position::line);
                Error::data(format!("{name}, line {line}: {:?} is no angle in deg", &row[at]))
                    .help("give a number in each cell of the two columns, or leave the row out")
            })
        };
        points.push([number(yaw)?, number(reference)?]);
    }
    match points.is_empty() {
        true => Err(Error::data(format!("{name} has no row below its columns' names")).help(HELP)),
        false => Ok(points),
    }
}

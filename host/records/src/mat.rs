//! MAT-files of version 5, the default of MATLAB's `save` (-v6, -v7).

use super::table::Channel;
use matfile::{MatFile, NumericData};
use std::fs::File;
use std::path::Path;

pub(super) fn read(file: &Path) -> std::result::Result<Vec<Channel>, String> {
    let opened = File::open(file).map_err(|e| e.to_string())?;
    let parsed = MatFile::parse(opened).map_err(|e| e.to_string())?;
    let channels = parsed.arrays().iter().map(|array| Channel {
        name: array.name().to_owned(),
        unit: None,
        step_s: None,
        values: vector(array.size()).and_then(|()| numbers(array.data())),
    });
    Ok(channels.collect())
}

/// That a variable is a row or a column.
fn vector(size: &[usize]) -> std::result::Result<(), String> {
    if size.iter().filter(|n| **n != 1).count() <= 1 {
        return Ok(());
    }
    let size: Vec<String> = size.iter().map(usize::to_string).collect();
    Err(format!("a {} matrix", size.join(" by ")))
}

fn numbers(data: &NumericData) -> std::result::Result<Vec<f64>, String> {
    macro_rules! real {
        ($($kind:ident),*) => {
            match data {
                $(NumericData::$kind { real, imag: None } => {
                    Ok(real.iter().map(|value| *value as f64).collect())
                })*
                _ => Err("complex numbers".to_owned()),
            }
        };
    }
    real!(Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Single, Double)
}

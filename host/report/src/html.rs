//! A report as one page that needs nothing but itself. A pure function of the report. HTML by hand: one
//! function makes every table, one (`escaped`) passes every text, and a template crate would add 4 s to the
//! first build.

use super::data::{DATA, DATA_END};
use super::escape::escaped;
use super::sections;
use super::{Report, MAX_BYTES};
use yawrig_base::error::{Error, Result};

/// uPlot, which draws in the browser.
pub const UPLOT: &str = include_str!("../assets/uplot/uplot.min.js");
pub const UPLOT_STYLE: &str = include_str!("../assets/uplot/uplot.min.css");
const UPLOT_LICENCE: &str = include_str!("../assets/uplot/LICENSE");
const SCRIPT: &str = include_str!("../assets/report.js");
const STYLE: &str = include_str!("../assets/report.css");

/// The whole page.
///
/// # Errors
/// Exit 3 where it would be larger than [`MAX_BYTES`].
pub fn page(report: &Report) -> Result<String> {
    // No text of the data can end the element it stands in.
    let data = report.json()?.replace('<', "\\u003c");
    let title = escaped(&report.title);
    let body = sections::body(report)?;
    let page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
         script-src 'unsafe-inline'; img-src data:\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
         <title>{title} - yawrig</title>\n<style>\n{UPLOT_STYLE}\n{STYLE}</style>\n</head>\n<body>\n{body}\n\
         {DATA}{data}{DATA_END}\n<script>\n/* uPlot:\n{UPLOT_LICENCE}*/\n{UPLOT}\n{SCRIPT}</script>\n</body>\n</html>\n"
    );
    if page.len() > MAX_BYTES {
        return Err(Error::data(format!(
            "the report would be {:.1} MB, more than {:.0}",
            page.len() as f64 / 1e6,
            MAX_BYTES as f64 / 1e6
        ))
        .help("report on fewer records at a time"));
    }
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::super::{data, Kind, Made};
    use super::*;

    #[test]
    fn what_users_write_is_text_and_comes_out_again() {
        let evil = "</script><script>alert('1')</script>&\"";
        let mut report = Report::new(Kind::Records, evil.to_owned(), Made::default());
        report.verdict = evil.to_owned();
        report.notes.push(evil.to_owned());
        report.made.command = evil.to_owned();
        let page = page(&report).unwrap();
        assert!(!page.contains("<script>alert"), "{page}");
        let back: Report = serde_json::from_str(data::of(&page).unwrap()).unwrap();
        assert_eq!(back, report);
        assert_eq!(data::of("<html>"), None);
        for reference in ["src=\"http", "href=\"http", "url(", "@import"] {
            assert!(!page.contains(reference), "{reference}");
        }
    }
}

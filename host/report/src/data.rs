//! A report's data in its page.

/// Around the data in the page.
pub(super) const DATA: &str = "<script type=\"application/json\" id=\"report-data\">";
pub(super) const DATA_END: &str = "</script>";

/// The data of a page as [`super::Report::json`] gave them; `None` where it is no report.
pub fn of(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once(DATA)?;
    Some(rest.split_once(DATA_END)?.0)
}

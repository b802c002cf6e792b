//! The page's own files, part of the program. uPlot draws the plots: 51 kB against 4.6 MB of plotly.js, and
//! the first picture stands as soon as the records are read.

use std::borrow::Cow;
use yawrig_report::html::{UPLOT, UPLOT_STYLE};

/// A file of the page: its type and contents.
pub struct Asset {
    pub kind: &'static str,
    pub text: Cow<'static, str>,
}

/// What both pages have in common, and where it stands in them.
const PANELS: &str = include_str!("../assets/panels.html");
const PANELS_MARK: &str = "<!-- panels.html -->\n";

/// A page with its panels.
fn page(text: &str) -> Asset {
    Asset { kind: "text/html; charset=utf-8", text: text.replace(PANELS_MARK, PANELS).into() }
}

macro_rules! asset {
    ($kind:literal, $path:expr) => {
        Asset { kind: $kind, text: Cow::Borrowed(include_str!(concat!("../assets/", $path))) }
    };
}

macro_rules! script {
    ($name:literal) => {
        asset!("text/javascript; charset=utf-8", concat!($name, ".js"))
    };
}

/// What the page that needs no server has in it, and no other page.
pub const STILL_MARK: &str = "<title>yawrig</title>";

/// Keeps that page's files in the browser, once it knows their names.
pub const OFFLINE: &str = include_str!("../assets/offline.js");

/// The files of the page that needs no server, but for the module.
pub fn still() -> Vec<(&'static str, Asset)> {
    let own = [
        ("index.html", page(include_str!("../assets/static.html"))),
        ("static.css", asset!("text/css; charset=utf-8", "static.css")),
        ("static.js", script!("static")),
        ("backend.js", script!("backend")),
        ("worker.js", script!("worker")),
        // A worker in the server's place.
        ("talk.js", script!("talk-worker")),
    ];
    let shared = [
        "workbench.css",
        "uplot.css",
        "uplot.js",
        "plots.js",
        "panels.js",
        "summaries.js",
        "effects.js",
        "dropped.js",
        "elements.js",
        "icon.svg",
    ];
    let named = |name: &'static str| at(&format!("/{name}")).map(|asset| (name, asset));
    own.into_iter().chain(shared.into_iter().filter_map(named)).collect()
}

/// The file at `path` of the page's address.
pub fn at(path: &str) -> Option<Asset> {
    Some(match path {
        "/" => page(include_str!("../assets/index.html")),
        "/workbench.css" => asset!("text/css; charset=utf-8", "workbench.css"),
        "/uplot.js" => Asset { kind: "text/javascript; charset=utf-8", text: UPLOT.into() },
        "/uplot.css" => Asset { kind: "text/css; charset=utf-8", text: UPLOT_STYLE.into() },
        "/plots.js" => script!("plots"),
        "/workbench.js" => script!("workbench"),
        "/talk.js" => script!("talk"),
        "/elements.js" => script!("elements"),
        "/panels.js" => script!("panels"),
        "/summaries.js" => script!("summaries"),
        "/releases.js" => script!("releases"),
        "/dropped.js" => script!("dropped"),
        "/effects.js" => script!("effects"),
        "/campaign.js" => script!("campaign"),
        "/law.js" => script!("law"),
        "/own.js" => script!("own"),
        "/steps.js" => script!("steps"),
        "/derivatives.js" => script!("derivatives"),
        "/live.js" => script!("live"),
        "/measure.js" => script!("measure"),
        "/numbers.js" => script!("numbers"),
        "/replay.js" => script!("replay"),
        "/icon.svg" => asset!("image/svg+xml", "icon.svg"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_pages_have_the_panels() {
        let still =
            still().into_iter().find(|(name, _)| *name == "index.html").map(|(_, page)| page);
        for page in [at("/"), still] {
            let text = page.expect("a page").text;
            assert_eq!(text.matches("<main id=\"panels\"").count(), 1);
            assert!(!text.contains(PANELS_MARK));
        }
    }
}

//! The page's own files, part of the program. uPlot draws the plots: 51 kB against 4.6 MB of plotly.js, and
//! the first picture stands as soon as the records are read.

use std::borrow::Cow;
use yawrig_report::html::{UPLOT, UPLOT_STYLE};

/// A file of the page: its type and contents.
pub struct Asset {
    pub kind: &'static str,
    pub text: Cow<'static, str>,
}

/// What both pages have in common.
const PAGE: &str = include_str!("../assets/index.html");
const PANELS: [&str; 2] = ["<!-- panels.html -->\n", include_str!("../assets/panels.html")];
/// What is followed live: on the page that has a server, and a board on the one that has none; what is drawn of it.
const LIVE: &str = include_str!("../assets/live.html");
const BOARD: &str = include_str!("../assets/board.html");
const DRAWN: &str = include_str!("../assets/drawn.html");
/// What each of them has in a place of its own, with the name of the place before it.
const OF_SERVER: &str = include_str!("../assets/server.html");
const OF_STILL: &str = include_str!("../assets/static.html");
const PLACES: [&str; 7] = ["title", "policy", "scripts", "opening", "nav", "printed", "dialogs"];

/// The page with these parts in their places.
fn page(parts: &str, live: &str) -> String {
    let text =
        PAGE.replace(PANELS[0], PANELS[1]).replace("<!-- live.html -->\n", &[live, DRAWN].concat());
    PLACES.iter().fold(text, |text, name| {
        let place = format!("<!-- {name} -->");
        let part = parts.split_once(&place).map_or("", |(_, rest)| rest);
        text.replace(&place, part.split("\n<!-- ").next().unwrap_or_default().trim_end())
    })
}

fn html(text: String) -> Asset {
    Asset { kind: "text/html; charset=utf-8", text: text.into() }
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
        // From whatever folder it is served.
        ("index.html", html(page(OF_STILL, BOARD).replace("=\"/", "=\""))),
        ("static.css", asset!("text/css; charset=utf-8", "static.css")),
        ("static.js", script!("static")),
        ("backend.js", script!("backend")),
        ("store.js", script!("store")),
        ("phone.js", script!("phone")),
        ("worker.js", script!("worker")),
        ("unpack-worker.js", script!("unpack-worker")),
        ("unpack.js", script!("unpack")),
        // A worker in the server's place.
        ("talk.js", script!("talk-worker")),
        // A board in the place of all that can be followed.
        ("live.js", script!("board")),
        ("board-worker.js", script!("board-worker")),
        ("kept.js", script!("kept")),
        ("plug.js", script!("plug")),
        ("campaign.js", script!("absent")),
        ("example.csv", asset!("text/csv; charset=utf-8", "example.csv")),
    ];
    let shared = [
        "workbench.css",
        "uplot.css",
        "uplot.js",
        "plots.js",
        "workbench.js",
        "address.js",
        "panels.js",
        "summaries.js",
        "releases.js",
        "effects.js",
        "law.js",
        "own.js",
        "steps.js",
        "derivatives.js",
        "drawn.js",
        "dropped.js",
        "elements.js",
        "numbers.js",
        "points.js",
        "icon.svg",
    ];
    let named = |name: &'static str| at(&format!("/{name}")).map(|asset| (name, asset));
    own.into_iter().chain(shared.into_iter().filter_map(named)).collect()
}

/// The file at `path` of the page's address.
pub fn at(path: &str) -> Option<Asset> {
    Some(match path {
        "/" => html(page(OF_SERVER, LIVE)),
        "/workbench.css" => asset!("text/css; charset=utf-8", "workbench.css"),
        "/uplot.js" => Asset { kind: "text/javascript; charset=utf-8", text: UPLOT.into() },
        "/uplot.css" => Asset { kind: "text/css; charset=utf-8", text: UPLOT_STYLE.into() },
        "/plots.js" => script!("plots"),
        "/workbench.js" => script!("workbench"),
        "/talk.js" => script!("talk"),
        "/elements.js" => script!("elements"),
        "/address.js" => script!("address"),
        "/panels.js" => script!("panels"),
        "/summaries.js" => script!("summaries"),
        "/releases.js" => script!("releases"),
        "/drawn.js" => script!("drawn"),
        "/dropped.js" => script!("dropped"),
        "/effects.js" => script!("effects"),
        "/campaign.js" => script!("campaign"),
        "/law.js" => script!("law"),
        "/own.js" => script!("own"),
        "/steps.js" => script!("steps"),
        "/derivatives.js" => script!("derivatives"),
        "/live.js" => script!("live"),
        "/measure.js" => script!("measure"),
        "/points.js" => script!("points"),
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
    fn both_pages_have_all_their_parts() {
        let still =
            still().into_iter().find(|(name, _)| *name == "index.html").map(|(_, page)| page);
        for page in [at("/"), still] {
            let text = page.expect("a page").text;
            assert_eq!(text.matches("<main id=\"panels\"").count(), 1);
            assert!(!text.contains("<!-- "), "{text}");
        }
        for (parts, has) in [(OF_SERVER, false), (OF_STILL, true)] {
            assert!(PLACES.iter().all(|name| parts.contains(&format!("<!-- {name} -->"))));
            assert_eq!(page(parts, "").contains("Content-Security-Policy"), has);
        }
    }

    /// A script that is missing is asked for in vain.
    #[test]
    fn the_page_without_a_server_has_every_file_that_its_scripts_import() {
        let files = still();
        for (name, asset) in files.iter().filter(|(name, _)| name.ends_with(".js")) {
            for part in asset.text.split("from \"./").skip(1) {
                let wanted = part.split('"').next().unwrap_or_default();
                let is_there = files.iter().any(|(name, _)| *name == wanted);
                assert!(is_there || wanted == "yawrig.js", "{name}: {wanted}");
            }
        }
    }
}

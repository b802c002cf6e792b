//! A device followed on the page, or a stored session shown again as if it were one.

mod following;
mod playing;
mod shown;
mod teller;

pub use shown::{Order, Shown};

use serde_json::{json, Value};
use std::path::Path;
use std::sync::Arc;
use yawrig_base::error::Result;
use yawrig_link::bench::Target;
use yawrig_link::live::sessions::{self, Listed};
use yawrig_link::live::stored::Stored;
use yawrig_link::port;

/// Follows a device: `emulated`, or a port's path; before an emulated one the built-in rig swings `speed`
/// (0.01 to 1000) times as fast as a real rig. `keep` is given the file of each release that is recorded of
/// it.
///
/// # Errors
/// Exit 2 where something is shown already. What is wrong with the device itself is shown later.
pub fn follow(
    shown: &Arc<Shown>,
    device: &str,
    speed: f64,
    keep: impl Fn(&Path) + Send + 'static,
) -> Result<()> {
    let Ok(target) = device.parse::<Target>();
    shown.begin(
        |seen| seen.begin(device, None),
        move |shown, orders| following::follow(shown, &target, speed, orders, &keep),
    )
}

/// Shows a stored session again from its beginning.
///
/// # Errors
/// Those of [`Stored::open`]; exit 3 where nothing is in it, 2 where something is shown already.
pub fn replay(shown: &Arc<Shown>, session: &Path) -> Result<()> {
    let stored = Stored::open(session)?;
    let replay = playing::replay_of(&stored)?;
    let first = replay.clone();
    shown.begin(
        |seen| seen.begin("", Some(first)),
        move |shown, orders| playing::play(shown, &stored, replay, orders),
    )
}

/// The devices that could be followed.
///
/// # Errors
/// Exit 4 where the ports cannot be listed.
pub fn devices() -> Result<Value> {
    let ports = port::list()?;
    Ok(json!({ "ports": ports }))
}

/// The stored sessions that could be shown, newest first: those in the folder of the page's recordings,
/// beside the model's file, and in the folders of both.
pub fn stored(model: &Path) -> Value {
    let beside = model.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut folders = Vec::new();
    for place in [Path::new(following::FOLDER), beside] {
        folders.push(place.to_owned());
        let inside = place.read_dir().into_iter().flatten().flatten();
        folders
            .extend(inside.filter(|e| e.file_type().is_ok_and(|t| t.is_dir())).map(|e| e.path()));
    }
    let listed = |session: &Listed| {
        let Listed { stem, duration_s, releases, marks, is_finished, is_damaged, .. } = session;
        // As a user would name it.
        let stem = stem.strip_prefix(".").unwrap_or(stem);
        json!({
            "session": stem.display().to_string(),
            "started": humantime::format_rfc3339_seconds(session.started).to_string(),
            "duration_s": duration_s, "releases": releases, "marks": marks,
            "is_finished": is_finished, "is_damaged": is_damaged,
        })
    };
    json!({"sessions": sessions::list(&folders).iter().map(listed).collect::<Vec<_>>()})
}

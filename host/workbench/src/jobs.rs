//! The worker's thread: what was asked for first, then what is made ready in the background.

use super::app::App;
use rayon::prelude::*;
use serde_json::json;
use std::sync::Arc;
use yawrig_base::interrupt;
use yawrig_session::steps::{make_view, run, without_view};

/// Works until the user stops the program.
pub fn work(app: &Arc<App>) {
    while !interrupt::requested() {
        match app.work.next() {
            Some(job) => {
                app.news.send(&json!({"kind": "job", "job": app.work.progress()}));
                let done = app.work.on_all_cores(|| run(&app.bench, &job));
                app.work.end(&job, done);
                app.session().refresh();
                app.news.all_may_differ();
            }
            None if make_ready(app) => {}
            None => app.work.nap(),
        }
    }
}

/// Makes views of the next releases ready. Whether there was one to be made.
fn make_ready(app: &Arc<App>) -> bool {
    let Some(wanted) = app.work.wanted() else { return false };
    let next = without_view(&app.bench, wanted);
    if next.is_empty() {
        return false;
    }
    app.work.in_background(|| {
        let at_once = rayon::current_num_threads();
        next.par_iter().take(at_once).for_each(|id| make_view(&app.bench, *id));
    });
    true
}

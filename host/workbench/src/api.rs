//! The page's requests and their answers.

use super::app::App;
use super::campaign::CampaignForm;
use super::live::{self, Order};
use super::{dropped, folder};
use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::Json;
use serde::Deserialize;
use serde_json::{json, Value};
use std::path::PathBuf;
use std::sync::Arc;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_campaign::plan::Wanted;
use yawrig_records::Selection;
use yawrig_report::channels;
use yawrig_session::job::Job;
use yawrig_session::requests::{self, AsRead, Deed, OfRelease, Previewed, Stretch};

type Answer = std::result::Result<Json<Value>, Refused>;

/// An error as the page shows it.
pub struct Refused(Error);

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

impl IntoResponse for Refused {
    fn into_response(self) -> Response {
        let status = match self.0.exit {
            Exit::Internal => StatusCode::INTERNAL_SERVER_ERROR,
            _ => StatusCode::CONFLICT,
        };
        (status, Json(json!({"error": {"message": self.0.message, "help": self.0.help}})))
            .into_response()
    }
}

/// Off the server's own threads: files are read and curves computed.
async fn aside(
    app: Arc<App>,
    work: impl FnOnce(&Arc<App>) -> Result<Value> + Send + 'static,
) -> Answer {
    let done = tokio::task::spawn_blocking(move || work(&app)).await;
    let done =
        done.map_err(|e| Error::internal(format!("the answer could not be computed: {e}")))?;
    Ok(Json(done?))
}

/// All that the page knows.
fn state(app: &App) -> Value {
    let (job, ended) = (app.work.progress(), app.work.ended());
    let mut state = yawrig_session::state(&app.bench, job.as_ref(), ended.as_ref());
    state["live"] = app.live.to_json();
    state
}

pub async fn state_of(State(app): State<Arc<App>>) -> Answer {
    aside(app, |app| Ok(state(app))).await
}

/// The library.
pub async fn effects() -> Json<Value> {
    Json(yawrig_session::library())
}

/// Measurement, models and residuals of a stretch of time.
pub async fn curves(State(app): State<Arc<App>>, Query(asked): Query<Stretch>) -> Answer {
    aside(app, move |app| requests::curves(&app.bench, &asked)).await
}

/// Verdict on a release, and where the model fails in a stretch of time.
pub async fn view(State(app): State<Arc<App>>, Query(asked): Query<Stretch>) -> Answer {
    aside(app, move |app| {
        app.work.want(asked.release);
        requests::view(&app.bench, &asked)
    })
    .await
}

/// Effects that the model may lack, best first.
pub async fn candidates(State(app): State<Arc<App>>, Query(asked): Query<OfRelease>) -> Answer {
    aside(app, move |app| requests::candidates(&app.bench, &asked)).await
}

/// The law that was measured, over the cuts of a release.
pub async fn law(State(app): State<Arc<App>>, Query(asked): Query<OfRelease>) -> Answer {
    aside(app, move |app| requests::law(&app.bench, &asked)).await
}

/// Derivatives of the campaign before and after.
pub async fn derivatives(State(app): State<Arc<App>>) -> Answer {
    aside(app, |app| Ok(yawrig_session::derivatives(&app.bench))).await
}

/// The report of the model, a page of its own.
pub async fn report(State(app): State<Arc<App>>) -> Answer {
    aside(app, |app| requests::report(&app.bench)).await
}

#[derive(Deserialize)]
pub struct CampaignAsked {
    folder: String,
    #[serde(default)]
    pattern: String,
}

/// Records of a folder from which a campaign can be made.
pub async fn campaign(State(app): State<Arc<App>>, Query(asked): Query<CampaignAsked>) -> Answer {
    aside(app, move |_| super::campaign::begin(&asked.folder)).await
}

/// What the names of records say.
pub async fn campaign_by_pattern(
    State(app): State<Arc<App>>,
    Json(asked): Json<CampaignAsked>,
) -> Answer {
    aside(app, move |_| super::campaign::by_pattern(&asked.folder, &asked.pattern)).await
}

/// What is wrong with a campaign so far.
pub async fn campaign_check(State(app): State<Arc<App>>, Json(form): Json<CampaignForm>) -> Answer {
    aside(app, move |_| form.check()).await
}

/// Records in the folder that are not open yet.
pub async fn files(State(app): State<Arc<App>>) -> Answer {
    aside(app, |app| folder::files(app)).await
}

#[derive(Deserialize)]
pub struct Dropped {
    name: String,
}

/// A file that was dropped on the page: kept, and what is to be asked about it.
pub async fn dropped(
    State(app): State<Arc<App>>,
    Query(of): Query<Dropped>,
    bytes: Bytes,
) -> Answer {
    aside(app, move |_| {
        let file = dropped::kept(&of.name, &bytes)?;
        channels::asked(&file, &Selection::default())
    })
    .await
}

/// Whether a file can be read so.
pub async fn as_read(State(app): State<Arc<App>>, Json(asked): Json<AsRead>) -> Answer {
    aside(app, move |_| requests::as_read(&asked)).await
}

/// History of a device for a page that has just been opened.
pub async fn live_history(State(app): State<Arc<App>>) -> Answer {
    aside(app, |app| Ok(app.live.history())).await
}

/// Devices that could be followed.
pub async fn devices(State(app): State<Arc<App>>) -> Answer {
    aside(app, |_| live::devices()).await
}

/// Stored sessions that could be shown again.
pub async fn sessions(State(app): State<Arc<App>>) -> Answer {
    aside(app, |app| Ok(live::stored(&app.session().model_path.clone()))).await
}

/// A user's own effect as far as it is typed.
pub async fn preview(State(app): State<Arc<App>>, Json(asked): Json<Previewed>) -> Answer {
    aside(app, move |app| Ok(requests::preview(&app.bench, &asked))).await
}

/// What a user does: at once, or as a job of the worker's.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Act {
    Cancel,
    /// Follows a device.
    Connect {
        device: String,
        /// How many times as fast as a real rig the built-in rig swings before an emulated one.
        speed: Option<f64>,
    },
    Disconnect,
    Record,
    StopRecording,
    Mark {
        text: String,
    },
    /// The coming releases of the device are made under this condition, or through this campaign.
    Measure {
        wanted: Box<Wanted>,
    },
    /// Leaves out the release that is next in it, or makes the last one again.
    Skip,
    Back,
    /// Shows a stored session again.
    Replay {
        session: PathBuf,
    },
    Play,
    Pause,
    Speed {
        times: f64,
    },
    Jump {
        time_s: f64,
    },
    /// Writes the campaign that a form describes.
    WriteCampaign {
        #[serde(flatten)]
        form: Box<CampaignForm>,
        over: bool,
    },
    #[serde(untagged)]
    Begin(Job),
    #[serde(untagged)]
    Deed(Deed),
}

pub async fn act(State(app): State<Arc<App>>, Json(act): Json<Act>) -> Answer {
    aside(app, move |app| do_it(app, act)).await
}

fn do_it(app: &Arc<App>, act: Act) -> Result<Value> {
    let order = |order| app.live.order(order);
    match act {
        Act::Begin(job) => {
            if let Some(id) = job.needs() {
                app.session().effect(id)?;
            }
            app.work.begin(job)?;
        }
        Act::Cancel => app.work.cancel(),
        Act::Deed(deed) => {
            let is_tick = matches!(deed, Deed::Tick { .. });
            let done = deed.run(&app.bench)?;
            if let Some(id) = done["release"].as_u64() {
                app.work.want(id as usize);
            }
            app.news.all_may_differ();
            return Ok(if is_tick { state(app) } else { done });
        }
        Act::Connect { device, speed } => app.follow(&device, speed.unwrap_or(1.0))?,
        Act::Replay { session } => live::replay(&app.live, &session)?,
        Act::Disconnect => order(Order::Leave)?,
        Act::Record => order(Order::Record)?,
        Act::StopRecording => order(Order::StopRecording)?,
        Act::Mark { text } => order(Order::Mark(text))?,
        Act::Measure { wanted } => order(Order::Measure(wanted))?,
        Act::Skip => order(Order::Skip)?,
        Act::Back => order(Order::Back)?,
        Act::Play => order(Order::Play)?,
        Act::Pause => order(Order::Pause)?,
        Act::Speed { times } => order(Order::Speed(times))?,
        Act::Jump { time_s } => order(Order::Jump(time_s))?,
        Act::WriteCampaign { form, over } => return form.write(app, over),
    }
    Ok(json!({}))
}

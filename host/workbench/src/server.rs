//! The page's server: who is let in, what is asked of the session, and the stream of news.

use super::access::Access;
use super::app::App;
use super::{api, assets};
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{header, HeaderValue, Method, StatusCode};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::Router;
use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::wrappers::BroadcastStream;
use tokio_stream::{Stream, StreamExt};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;

/// How often the main thread looks for Ctrl-C.
const GLANCE: Duration = Duration::from_millis(20);
/// Looks between two at whether the model's files were changed by someone else.
const GLANCES_PER_LOOK: u32 = 25;

/// Bytes of a file that is dropped on the page.
const MAX_DROPPED: usize = 512 << 20;

/// What the page may do: be shown, and speak to this server.
const POLICY: &str =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A port of this machine, taken.
///
/// # Errors
/// Exit 4 where it is held by another program or not permitted.
pub fn bound(ip: IpAddr, port: u16) -> Result<std::net::TcpListener> {
    let address = SocketAddr::new(ip, port);
    let listener = std::net::TcpListener::bind(address)
        .and_then(|l| l.set_nonblocking(true).map(|()| l))
        .map_err(|e| {
            let why = match e.kind() {
                std::io::ErrorKind::AddrInUse => "another program holds this port".to_owned(),
                std::io::ErrorKind::AddrNotAvailable => {
                    "it is not an address of this machine".to_owned()
                }
                std::io::ErrorKind::PermissionDenied => "you may not take this port".to_owned(),
                _ => e.to_string(),
            };
            Error::device(format!("cannot serve the page at {address}: {why}"))
                .help("leave --port out for a free one, and --allow-remote for this machine alone")
        })?;
    Ok(listener)
}

/// Serves until the user stops it. Nothing is waited for: a tab that is open holds a stream open for ever.
///
/// # Errors
/// 130 on Ctrl-C; exit 1 where the server ends by itself.
pub fn run(listener: std::net::TcpListener, app: &Arc<App>) -> Result<()> {
    let internal = |e: std::io::Error| Error::internal(format!("cannot serve the page: {e}"));
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(internal)?;
    let serving = {
        let _inside = runtime.enter();
        let listener = tokio::net::TcpListener::from_std(listener).map_err(internal)?;
        let router = router(app);
        runtime.spawn(async move { axum::serve(listener, router).await })
    };
    let mut glances = 0u32;
    let done = loop {
        if let Err(interrupted) = interrupt::check() {
            break Err(interrupted);
        }
        if serving.is_finished() {
            break Err(Error::internal("the page's server has ended by itself"));
        }
        glances = glances.wrapping_add(1);
        if glances.is_multiple_of(GLANCES_PER_LOOK) {
            app.look_at_files();
        }
        std::thread::sleep(GLANCE);
    };
    runtime.shutdown_background();
    done
}

fn router(app: &Arc<App>) -> Router {
    Router::new()
        .route("/api/state", get(api::state_of))
        .route("/api/effects", get(api::effects))
        .route("/api/curves", get(api::curves))
        .route("/api/view", get(api::view))
        .route("/api/candidates", get(api::candidates))
        .route("/api/law", get(api::law))
        .route("/api/derivatives", get(api::derivatives))
        .route("/api/report", get(api::report))
        .route("/api/campaign", get(api::campaign))
        .route("/api/campaign/pattern", post(api::campaign_by_pattern))
        .route("/api/campaign/check", post(api::campaign_check))
        .route("/api/files", get(api::files))
        .route("/api/live", get(api::live_history))
        .route("/api/devices", get(api::devices))
        .route("/api/sessions", get(api::sessions))
        .route("/api/news", get(news))
        .route("/api/preview", post(api::preview))
        .route("/api/drop", post(api::dropped).layer(DefaultBodyLimit::max(MAX_DROPPED)))
        .route("/api/as_read", post(api::as_read))
        .route("/api/do", post(api::act))
        .fallback(asset)
        .with_state(app.clone())
        .layer(middleware::from_fn_with_state(app.access.clone(), guarded))
}

/// Lets in whom [`Access`] lets in, and says to the browser how narrow the page is.
async fn guarded(State(access): State<Arc<Access>>, request: Request, next: Next) -> Response {
    let mut response = match access.check(request.headers(), request.uri()) {
        Err(refusal) => (StatusCode::FORBIDDEN, refusal.text()).into_response(),
        // The token leaves the address bar, the history and whatever the address is copied to.
        Ok(()) if request.uri().path() == "/" && access.opens(request.uri()) => {
            let mut moved = StatusCode::SEE_OTHER.into_response();
            moved.headers_mut().insert(header::LOCATION, HeaderValue::from_static("/"));
            if let Ok(cookie) = HeaderValue::from_str(&access.cookie()) {
                moved.headers_mut().insert(header::SET_COOKIE, cookie);
            }
            moved
        }
        Ok(()) => next.run(request).await,
    };
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn asset(request: Request) -> Response {
    match assets::at(request.uri().path()) {
        Some(_) if request.method() != Method::GET && request.method() != Method::HEAD => {
            StatusCode::METHOD_NOT_ALLOWED.into_response()
        }
        Some(asset) => {
            let kind = HeaderValue::from_static(asset.kind);
            ([(header::CONTENT_TYPE, kind)], Body::from(asset.text)).into_response()
        }
        None => (StatusCode::NOT_FOUND, "404: there is no such page\n").into_response(),
    }
}

/// A line whenever something has changed; the page asks for what it wants to know of it.
async fn news(
    State(app): State<Arc<App>>,
) -> Sse<impl Stream<Item = std::result::Result<Event, Infallible>>> {
    let stream = BroadcastStream::new(app.news.subscribe()).map(|news| {
        // One that has missed some asks for everything.
        let text = news.unwrap_or_else(|_| r#"{"kind":"state"}"#.to_owned());
        Ok(Event::default().data(text))
    });
    Sse::new(stream).keep_alive(KeepAlive::default())
}

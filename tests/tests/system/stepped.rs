//! The client over a line that never waits, as a page's stream is: it is polled, and its bytes are carried between
//! two polls.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};
use yawrig_protocol::client::Client;
use yawrig_protocol::flash::{self, Silent};
use yawrig_protocol::line::{completed, Incoming, Line, Words};
use yawrig_shared::wire::Decoder;
use yawrig_tests::line::Board;
use yawrig_tests::{networks, PATIENCE};

const WORDS: Words = Words {
    another_port: "another port",
    nobody: "see that it has power",
    gone: "plug it in",
    write_again: "write it again",
    which_runs: "ask it",
    sign: String::new,
};

/// What passes between the client and the far end.
#[derive(Default)]
struct Between {
    sent: Vec<u8>,
    came: VecDeque<Incoming>,
    bytes: u64,
    gone: bool,
}

struct Stepped(Rc<RefCell<Between>>);

impl Line for Stepped {
    fn name(&self) -> &str {
        "the plug"
    }

    fn words(&self) -> &'static Words {
        &WORDS
    }

    fn tries(&self) -> u32 {
        3
    }

    fn random(&mut self) -> u32 {
        66
    }

    fn bytes(&self) -> u64 {
        self.0.borrow().bytes
    }

    async fn send(&mut self, bytes: &[u8]) -> Result<bool, String> {
        self.0.borrow_mut().sent.extend(bytes);
        Ok(true)
    }

    async fn receive(&mut self, patience: Duration) -> Result<Option<Incoming>, String> {
        let until = Instant::now() + patience;
        poll_fn(|_| {
            let mut between = self.0.borrow_mut();
            match between.came.pop_front() {
                Some(came) => Poll::Ready(Ok(Some(came))),
                None if between.gone => Poll::Ready(Err("pulled".to_owned())),
                None if Instant::now() >= until => Poll::Ready(Ok(None)),
                None => Poll::Pending,
            }
        })
        .await
    }

    async fn pause(&mut self, duration: Duration) {
        let until = Instant::now() + duration;
        poll_fn(|_| if Instant::now() < until { Poll::Pending } else { Poll::Ready(()) }).await;
    }
}

/// What `what` comes to, `far` answering what is sent between two polls; nothing pulls the plug.
fn stepped<T>(
    between: &Rc<RefCell<Between>>,
    mut far: impl FnMut(&[u8]) -> Option<Vec<u8>>,
    what: impl Future<Output = T>,
) -> T {
    let (mut what, mut decoder, begun) = (pin!(what), Decoder::new(), Instant::now());
    loop {
        if let Poll::Ready(done) = what.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return done;
        }
        assert!(begun.elapsed() < PATIENCE);
        let sent = std::mem::take(&mut between.borrow_mut().sent);
        let said = far(&sent);
        let mut between = between.borrow_mut();
        between.gone = said.is_none();
        let said = said.unwrap_or_default();
        between.bytes += said.len() as u64;
        between.came.extend(said.iter().filter_map(|byte| completed(&mut decoder, *byte)));
    }
}

#[test]
fn a_network_is_written_step_by_step() {
    let board = Board::default();
    let between = Rc::<RefCell<Between>>::default();
    let mut swallowed = false;
    let far = |bytes: &[u8]| {
        let said = board.exchange(bytes);
        // The first answer is lost: it is asked for again, and not obeyed twice.
        let lost = !said.is_empty() && !std::mem::replace(&mut swallowed, true);
        Some(if lost { Vec::new() } else { said })
    };
    let another = networks::another();
    let written = stepped(&between, far, async {
        let mut client = Client::open(Stepped(between.clone())).await?;
        assert!(client.identity.board.contains("on the bench"));
        flash::write(&mut client, &another, None, &mut Silent).await
    });
    assert_eq!(written.expect("it is written"), 1);
    assert_eq!(format!("{:08x}", board.status().network.id), networks::id(&another));
}

#[test]
fn a_plug_that_is_pulled_meanwhile_is_told_and_nothing_is_half_written() {
    let board = Board::default();
    let before = board.status().network.id;
    let between = Rc::<RefCell<Between>>::default();
    let mut bytes_sent = 0;
    let far = |bytes: &[u8]| {
        bytes_sent += bytes.len();
        (bytes_sent < 1500).then(|| board.exchange(bytes))
    };
    let written = stepped(&between, far, async {
        let mut client = Client::open(Stepped(between.clone())).await?;
        flash::write(&mut client, &networks::another(), None, &mut Silent).await
    });
    let error = written.expect_err("it was pulled");
    assert_eq!(error.message, "writing to the device on the plug failed: it is gone: pulled");
    assert!(error.help.contains("old network") && error.help.contains("write it again"));
    assert_eq!(board.status().network.id, before);
}

#[test]
fn who_does_not_answer_is_asked_three_times() {
    let between = Rc::<RefCell<Between>>::default();
    let mut asked = 0;
    let far = |bytes: &[u8]| {
        asked += usize::from(!bytes.is_empty());
        Some(Vec::new())
    };
    let opened = stepped(&between, far, Client::open(Stepped(between.clone())));
    let error = opened.err().expect("nobody is there");
    assert_eq!(error.message, "the device on the plug does not answer (its name)");
    assert_eq!((error.help.as_str(), asked), ("see that it has power", 3));
}

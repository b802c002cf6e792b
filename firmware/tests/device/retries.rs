//! A request that is sent again is answered again and not carried out again, whoever asked in between.

use crate::desk::Desk;
use ed25519_compact::{KeyPair, Seed};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{encode, Decoder, Reply, Request};

impl Desk {
    /// Asks under this number, as one of several programs.
    fn ask_as(&mut self, number: u16, request: &Request) -> Reply {
        for byte in encode(number, request).expect("a frame") {
            self.device.receive(byte);
        }
        let mut decoder = Decoder::new();
        let mut reply = None;
        while let Some(byte) = self.device.transmit() {
            if let Some(Ok(frame)) = decoder.push(byte) {
                reply = frame.message::<Reply>().or(reply);
            }
        }
        reply.expect("a reply").expect("one that is whole")
    }
}

#[test]
fn a_retry_after_another_client_s_request_does_not_act_again() {
    let mut desk = Desk::new(MemoryFlash::new());
    let key = *KeyPair::from_seed(Seed::new([1; 32])).pk;
    let lock = Request::Lock { key };
    assert_eq!(desk.ask_as(1000, &lock), Reply::Done);
    // Its answer is lost; others ask, and it asks again.
    for other in 0..3 {
        assert!(matches!(desk.ask_as(2000 + other, &Request::Status), Reply::Status(_)));
    }
    assert_eq!(desk.ask_as(1000, &lock), Reply::Done);
    let challenge = desk.ask_as(1001, &Request::Challenge);
    assert!(matches!(desk.ask_as(3000, &Request::Event { number: 9 }), Reply::Refused(_)));
    assert_eq!(desk.ask_as(1001, &Request::Challenge), challenge);
    // Another's request under the same number is another's.
    assert!(matches!(desk.ask_as(1001, &Request::Status), Reply::Status(_)));
    assert_ne!(desk.ask_as(1002, &Request::Challenge), challenge);
}

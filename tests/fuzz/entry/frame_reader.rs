//! Any bytes on the serial line, as requests and as replies.

use bnkf::protocol::{FrameReader, Reply, Request, encode};

/// Panics where the reader does, or where what was read is not what would be sent for it.
pub fn run(bytes: &[u8]) {
    let mut requests = FrameReader::new();
    let mut replies = FrameReader::new();
    for &byte in bytes {
        if let Some(Ok(request)) = requests.push::<Request>(byte) {
            let frame = encode(&request).expect("what came in a frame fits one");
            let mut again = FrameReader::new();
            let read = frame
                .iter()
                .filter_map(|&b| again.push::<Request>(b))
                .last();
            // NaN is not equal to itself: compare what is sent.
            let back = encode(&read.expect("a frame").expect("a request")).expect("a frame");
            assert_eq!(frame, back);
        }
        if let Some(Ok(reply)) = replies.push::<Reply>(byte) {
            assert!(encode(&reply).is_ok());
        }
    }
    // A zero byte ends whatever was there, and the next frame is read.
    requests.push::<Request>(0);
    let hello = encode(&Request::Hello).expect("fits");
    let read: Vec<_> = hello.iter().filter_map(|&b| requests.push(b)).collect();
    assert_eq!(read, [Ok(Request::Hello)]);
}

//! What a process of the test says on its standard output: a JSON object a line.

use std::io::{BufRead as _, BufReader};
use std::process::Child;
use std::sync::{Arc, Condvar, Mutex};

use serde_json::Value;

/// All lines so far, and a bell for the next one.
pub(crate) type Lines = Arc<(Mutex<Vec<Value>>, Condvar)>;

/// Listens from now on, until the process has no more to say.
pub(crate) fn listen(child: &mut Child) -> Lines {
    let output = BufReader::new(child.stdout.take().unwrap());
    let lines = Lines::default();
    let writer = Arc::clone(&lines);
    std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            writer.0.lock().unwrap().push(serde_json::from_str(&line).unwrap());
            writer.1.notify_all();
        }
    });
    lines
}

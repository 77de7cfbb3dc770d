//! The page: records that are dropped into a browser are read, run and fitted there.
//!
//! The fields of the page are flags of the program ([`form`]) and are handed to the calls behind `granchain start` and `granchain calibrate`
//! ([`answer`]), so that both give the same messages and the same report; flags in a message become names of fields ([`word`]).
//! Files stay in memory. The functions below are called by the worker, `page/worker.js`.

pub mod answer;
pub mod form;
pub mod word;

use serde::Serialize;
use wasm_bindgen::prelude::wasm_bindgen;

use self::{answer::Refused, form::Form};

#[wasm_bindgen]
extern "C" {
    /// So much of so much is done; the worker tells the page.
    fn progress(done: f64, all: f64);
    /// What a bug says before the module ends.
    fn panicked(text: &str);
}

/// Has a panic reported; called once.
#[wasm_bindgen]
pub fn begin() -> String {
    std::panic::set_hook(Box::new(|panic| panicked(&panic.to_string())));
    json(&Ok(answer::benches()))
}

/// Reads the files of a form, whose bytes follow in the same order.
#[wasm_bindgen]
pub fn look(form: &str, first: Vec<u8>, second: Option<Vec<u8>>) -> String {
    json(&Form::of(form, first, second).and_then(|form| answer::look(&form)))
}

/// Runs the chain as the form has it, and fits nothing.
#[wasm_bindgen]
pub fn dry_run(form: &str, first: Vec<u8>, second: Option<Vec<u8>>) -> String {
    json(&Form::of(form, first, second).and_then(|form| answer::dry_run(&form)))
}

/// Fits.
#[wasm_bindgen]
pub fn fit(form: &str, first: Vec<u8>, second: Option<Vec<u8>>) -> String {
    let tell = |done: u64, all: u64| progress(done as f64, all as f64);
    json(&Form::of(form, first, second).and_then(|form| answer::fit(&form, tell)))
}

/// An answer, or why there is none, for the page.
fn json<T: Serialize>(answer: &Result<T, Refused>) -> String {
    let written = match answer {
        Ok(answer) => serde_json::to_string(answer),
        Err(refused) => serde_json::to_string(refused),
    };
    written.unwrap_or_else(|error| format!("{{\"message\":\"the answer cannot be written as JSON: {error:?}\"}}"))
}

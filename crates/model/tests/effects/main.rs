//! Effects that a scene may call for beside contacts and dashpots, against closed forms.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod chain;
mod impact;
mod published;

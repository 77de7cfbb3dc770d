//! Any text read as a scene; lines behind a form feed are overrides, as of `--set`.

#![no_main]

#[path = "../../allocator/mod.rs"]
mod allocator;

use std::path::Path;

use granchain::scene::{Scene, load_text};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let (file, overrides) = text.split_once('\u{c}').unwrap_or((text, ""));
    let overrides: Vec<String> = overrides.lines().map(str::to_owned).collect();
    let (read, peak) = allocator::peak_of(|| load_text(file, Path::new("/lab/own.toml"), &overrides));
    match read {
        Err(refused) => assert!(!refused.to_string().is_empty()),
        Ok(loaded) => {
            let written = loaded.scene.to_toml();
            let again: Scene = load_text(&written, Path::new("/lab/own.toml"), &[])
                .unwrap_or_else(|error| panic!("{error}\n{written}"))
                .scene;
            assert_eq!(again.to_toml(), written);
        }
    }
    assert!(peak <= 10 * text.len() + allocator::ANY_SCENE, "{peak} bytes of memory for {} of scene", text.len());
});

//! Any laboratory file: what it is, and its first samples as SI.
//!
//! `cargo run --release -p granchain-record --example read -- FILE [SENSITIVITY]`, such as `scope.csv '125 mm/s/V'`.

use std::{env, error::Error, path::Path};

use granchain_record::{ReadOptions, Sensitivity, inspect_record};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let file = arguments.next().ok_or("name a file")?;
    let scale = arguments.next().map(|text| Sensitivity::parse(&text)).transpose()?;
    let record = inspect_record(Path::new(&file), &ReadOptions { scale, ..ReadOptions::default() })?;
    println!("{} samples at {} Hz of {:?}", record.series.len(), record.series.sample_rate(), record.recorded);
    for (index, value) in record.series.values.iter().take(5).enumerate() {
        println!("{:.9e} s  {value:.6e}", record.series.time(index));
    }
    record.assumptions.iter().for_each(|assumption| println!("assumed: {assumption}"));
    Ok(())
}

//! The same of hits of a striker: records of a force sensor, with impulses and no drive.

use std::path::PathBuf;

use serde_json::json;

use super::{Arguments, BENCH, OUT, open_settings, place, toml_text};
use crate::{
    calibration::impact::Experiment,
    cli::{
        Outcome,
        arguments::Session,
        output::{refuse_existing, write_new},
    },
    measurement::{read_sensor, sensor_column, shell_word},
    report::number::{engineering, significant},
    scene::{self, ModelKind},
};

/// The usual bench of such records.
const SCENE: &str = "impact";

/// What may differ on it.
const TABLES: [&str; 4] = ["chain.", "drive.", "support.", "damping."];

/// Recognise hits by the column of a force sensor and two impulses, and begin their plan; `None` of other files.
///
/// # Errors
/// A scene that cannot be read, a file that is in the way.
pub fn begin(arguments: &Arguments, session: &Session) -> anyhow::Result<Option<Outcome>> {
    let options = arguments.reading.options(None);
    let record = |path: &PathBuf| {
        sensor_column(path, &options)?;
        read_sensor(path, &options).ok()
    };
    if options.scale.is_some() || arguments.horn.is_some() || arguments.files.is_empty() {
        return Ok(None);
    }
    let Some(records) = arguments.files.iter().map(record).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let name = arguments.scene.as_deref().unwrap_or(SCENE);
    let loaded = scene::load_preferring(name, &arguments.set, ModelKind::Chain)?;
    let records = records.into_iter().flatten().map(|record| (record, None)).collect();
    let Ok(Experiment { hits, .. }) = Experiment::of(records, loaded.scene.clone(), Vec::new()) else {
        return Ok(None);
    };
    refuse_existing(&arguments.out, OUT)?;
    let out = arguments.out.display().to_string();
    let plan = shell_word(&out);
    let records: String = arguments
        .files
        .iter()
        .map(|file| {
            format!(
                "\n[[record]]\nmeasured = {}\n# set_up = 'first' # of records of several set-ups of the column\n",
                place(arguments, file)
            )
        })
        .collect();
    let text = format!(
        "# A plan, begun by `granchain start`: hits of a striker on a force sensor. Lines behind `#` are examples: remove the `#` and type your own value.\n\
         #\n#   granchain calibrate --plan {plan}\n#   granchain calibrate --plan {plan} --measured hits/*.csv   # all hits of one column together\n#\n\
         {BENCH}\nscene = {}\nset = [\n{}]\n\n\
         # What is fitted; alpha (a factor on the velocity) and damping can be too.\nfit = ['support_modulus', 'support_loss']\n\n\
         # [uncertainty] # standard deviations, of the logarithm\n# drive = 0.05 # the striker's velocity\n\
         # modulus = 0.004 # the beads' stiffness over their mass\n{records}",
        toml_text(name),
        open_settings(&arguments.set, &loaded.scene, &TABLES)
    );
    write_new(&arguments.out, text.as_bytes(), "", OUT)?;
    let found = hits.iter().map(|hit| {
        format!(
            "{}: impulses of a force sensor (`{}`), no drive; the first returns after {} with {} of its height\n",
            hit.record.path.display(),
            hit.record.column,
            engineering(hit.impulses.returned.delay, "s", 4),
            significant(hit.impulses.returned.ratio, 2)
        )
    });
    let text = format!(
        "{}scene    {name}: {}\nwritten  {out}; state your bench there, then run: granchain calibrate --plan {plan}\n",
        found.collect::<String>(),
        loaded.scene.description
    );
    let measured: Vec<_> = hits.iter().map(|hit| &hit.record.path).collect();
    let times: Vec<f64> = hits.iter().map(|hit| hit.impulses.returned.delay).collect();
    let value = json!({ "plan": arguments.out, "measured": measured, "scene": name, "return_time_s": times });
    session.result(text, &value)?;
    Ok(Some(Outcome::Done))
}

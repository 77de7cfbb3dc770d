//! granchain replays laboratory experiments on driven granular chains and calibrates a model of them against what was
//! recorded.
//!
//! # The experiment
//!
//! A few millimetre-sized spheres stand in a row between a vibrating horn (the piston) and a support. The horn shakes the
//! first bead with about a micrometre at tens of kilohertz; the contacts press but cannot pull, so the chain answers with
//! impulses, with lines at fractions of the drive frequency, or with chaos. A laser looks at the far pole of the last
//! bead. A record is therefore a pair: the horn tip's displacement u₀(t) and the pole's velocity.
//!
//! # The problem as equations
//!
//! Bead i = 1…N of mass mᵢ has one unknown, its displacement uᵢ, positive from piston to support:
//!
//! ```text
//! m_i ü_i = F_{i−1} − F_i                                       Newton, between contacts i−1 and i
//! F_i     = k_i δ_i^(3/2) + (c + γ √δ_i) δ̇_i    while δ_i > 0    Hertz and dashpots
//! F_i     = 0                                   otherwise       separated; never negative, unless damping.tension
//! δ_i     = δ⁰_i − g_i + u_i − u_{i+1}                           overlap of contact i = 0…N
//! u_0     = α u_horn(t),   u_{N+1} = 0                          piston (prescribed) and support
//! u_i(0)  = 0,   u̇_i(0) = 0                                     at rest
//! ```
//!
//! k comes from the materials and radii of the two bodies (4/3 E* √R*), δ⁰ is the overlap that carries a precompression,
//! g the initial gaps. The last contact may be a resin annulus with its own force law, or a spring. The drive is a formula or
//! a recorded horn tip. A calibration asks: which α and which damping coefficient (c or γ) make the velocity of the
//! pole look like the record, how sure is that, and does the model explain the record at all? α is 1 if both sensitivities are right
//! and the horn's face moves as its recorded point.
//!
//! # The pipeline
//!
//! ```text
//! measurement ──► record ─────────────────────────────┐
//!      │                                              ▼
//!      └─ horn tip ─► scene ─► model ─► response ─► feature ─► calibration ─► report
//!                                                     ▲
//!                                   signal: the lab's bandwidth, delay, instants
//! ```
//!
//! | crate | folder | content |
//! |---|---|---|
//! | [`granchain_signal`] | (root) | evenly sampled series, quantities with units, filters, resampling, splines |
//! | | [`feature`] | numbers worth comparing, of record and simulation alike: peaks, lines, distortion, similarity |
//! | [`granchain_record`] | (root) | the one reader of laboratory files; published numbers; seals of kept files |
//! | [`granchain_model`] | [`scene`] | what stands on the bench and how it is driven: TOML files, keys, effects |
//! | | [`response`] | what a run produced: traces, contact forces, energy balance, work counts |
//! | | [`model::contact_law`] | elastic law F(δ) and dashpots of a contact |
//! | | [`model::chain`] | the discrete chain: adaptive, fixed-step, and eight runs at once |
//! | | [`model::fea`] | axisymmetric bodies in quadratic elements with contact by Lagrange multipliers |
//! | | [`model::reduced`] | the same bodies in a few modes each |
//! | | [`model::water`] | disc and water behind the chain |
//! | | [`model::analytical`] | closed forms that the models are held against |
//! | [`granchain_calibration`] | (root) | problem, search, fidelity levels, likelihood, posterior, diagnosis, outcome |
//! | [`granchain_report`] | (root) | figures, tables, pages |
//! | granchain | [`cli`] | the `granchain` program, one subcommand a file |
//!
//! A crate uses those above it; between folders of one crate `tests/architecture.rs` checks the imports. The names below are those of the
//! crates, shortened: [`signal`] is `granchain_signal`, [`measurement`] `granchain_record`, [`study`] the predictive runs of `granchain_calibration`.
//!
//! Words are explained once, in the Terms of `docs/README.md`.
//!
//! ```
//! use granchain::{feature, model, scene, study::observation};
//!
//! let scene = scene::load("annulus", &["alpha=0.5".into(), "damping.coefficient=0.3 N s/m".into()])?;
//! let response = model::run(&scene, &mut |_| true)?;
//! let features = feature::measure(response.observed_velocity(), &observation::settings(&scene)?)?;
//! assert!((0.25..0.35).contains(&features.peaks.positive)); // m/s; the source paper prints 0.296
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Symbols
//!
//! In memory everything is coherent SI in `f64`; at every border (files, flags, JSON) the unit stands in the key or beside
//! the value.
//!
//! | symbol | name | unit | not to be confused with |
//! |---|---|---|---|
//! | α | `amplitude_scale`, `alpha` in files | 1 | |
//! | δ; g = −δ | `overlap` (> 0 pressed); `gap` (> 0 open) | m | |
//! | k | `hertz_stiffness` | N·m^(-3/2) | tangent stiffness, N/m |
//! | F | contact force, ≥ 0 pressing | N | |
//! | c; γ | `coefficients[DampingTerm::Linear]`; `[DampingTerm::KuwabaraKono]` | N·s/m; N·s·m^(-3/2) | speed of sound |
//! | f0 | `drive_frequency` | Hz | a resonance |
//! | A(f0/3)/A(f0) | line ratio, of amplitudes | 1 | its square, dB |
//! | τ | `ring_up` of a tone burst | s | delay of the vibrometer |
//! | κ | speed factor of a solitary wave | 1 | |
//! | SL(x) | synthetic log-likelihood at the parameters x | 1 | misfit |
//! | scatter | standard deviation under what the laboratory cannot control | of its feature | sensitivity: change for +1 % drive |
//!
//! # Where to look
//!
//! The equations of motion: [`model::chain`]. A calibration from a program: [`calibration::problem`]. The fit: [`calibration::likelihood`], [`calibration::search`],
//! [`calibration::posterior`]; the procedure in words: `docs/method.md`, how it was tested: `docs/validation.md`. Every file form:
//! `docs/formats.md`. Why things are as they are: `docs/decisions/`. One question a program: `examples/`.

pub mod cli;

pub use granchain_calibration as calibration;
pub use granchain_calibration::predict as study;
pub use granchain_model::{self as model, response, scene};
pub use granchain_record as measurement;
pub use granchain_report as report;
pub use granchain_signal::{self as signal, feature};

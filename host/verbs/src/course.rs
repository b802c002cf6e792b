//! The model of a record as a function of the record's own clock, in the record's units.

use yawrig_core::fit::fitting::Fitted;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::motion::readings_at;
use yawrig_core::motion::simulate::Motion;
use yawrig_core::record::Measurand;

/// The equation of a model with its numbers, and where it begins. A state is angle, rate, and of each effect
/// that remembers what it remembers: of an angle deg, deg/s and deg; then the states of own effects, in the
/// units of their files.
#[derive(Clone, Debug)]
pub struct Course {
    motion: Motion,
    zero_rad: f64,
    measurand: Measurand,
    release_time_s: f64,
    first_s: f64,
    /// Where it begins.
    state: Vec<f64>,
    /// Of the states of own effects.
    own_units: Vec<String>,
}

impl Course {
    /// Of `model`, fitted to `decay`.
    pub fn new(decay: &FreeDecay, model: &Fitted) -> Self {
        let motion = model.motion();
        let mut course = Self {
            state: motion.state(decay.grid.start_s),
            own_units: model.structure.own_state_units(decay.wind_speed_m_s),
            motion,
            zero_rad: model.sensor_zero_rad().map_or(0.0, |zero| zero.value),
            measurand: decay.measurand.clone(),
            release_time_s: decay.release_time_s,
            first_s: decay.grid.start_s,
        };
        let state = std::mem::take(&mut course.state);
        course.state = course.shown(state);
        course
    }

    /// What the model reads at these instants, in order; NaN before [`Self::start_s`].
    pub fn readings(&self, time_s: &[f64]) -> Vec<f64> {
        let times: Vec<f64> = time_s.iter().map(|t| t - self.release_time_s).collect();
        let readings = readings_at(&self.motion, self.first_s, &times);
        readings.into_iter().map(|y| self.measurand.shown(y + self.zero_rad)).collect()
    }

    /// Where the model begins.
    pub fn start_s(&self) -> f64 {
        self.release_time_s + self.first_s
    }

    /// The state there.
    pub fn state(&self) -> Vec<f64> {
        self.state.clone()
    }

    /// The unit of each number of a state.
    pub fn units(&self) -> Vec<String> {
        let of = self.measurand.coordinate_unit().to_owned();
        let mut units = vec![of; self.state.len() - self.own_units.len()];
        units[1] = self.measurand.rate_unit();
        units.extend(self.own_units.iter().cloned());
        units
    }

    /// How fast each number of `state`, which is as long as [`Self::state`], changes, per s.
    pub fn slope(&self, time_s: f64, state: &[f64]) -> Vec<f64> {
        self.shown(self.motion.slope(time_s - self.release_time_s, &self.of_model(state)))
    }

    /// What the record would show of `state`.
    pub fn reading(&self, time_s: f64, state: &[f64]) -> f64 {
        let time_s = time_s - self.release_time_s;
        let reading = self.motion.reading_of(time_s, &self.of_model(state));
        self.measurand.shown(reading + self.zero_rad)
    }

    fn shown(&self, state: Vec<f64>) -> Vec<f64> {
        self.changed(state, |x| self.measurand.shown(x))
    }

    fn of_model(&self, state: &[f64]) -> Vec<f64> {
        self.changed(state.to_vec(), |x| self.measurand.of_model(x))
    }

    /// The states of own effects stay in their units.
    fn changed(&self, mut state: Vec<f64>, by: impl Fn(f64) -> f64) -> Vec<f64> {
        let of_motion = state.len() - self.own_units.len();
        state[..of_motion].iter_mut().for_each(|x| *x = by(*x));
        state
    }
}

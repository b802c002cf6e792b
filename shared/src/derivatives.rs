//! stand-in
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Wind {
    pub density_kg_m3: f64,
    pub speed_m_s: f64,
}
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Model {
    pub length_m: f64,
    pub frontal_area_m2: f64,
}
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Modal {
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

//! The device in memory: its sensors, its flash, its results.

mod chip;
mod conversions;
mod desk;
mod embassy;
mod events;
mod gaps;
mod holds;
mod learning;
mod learnt_power_cuts;
mod linearity;
mod lock;
mod lock_faults;
mod noise;
mod nucleo_f446re;
mod power_cuts;
mod reference;
mod retries;
mod rp;
mod scales;
mod sensors;
mod slots;
mod small;
mod time_base;
mod trial;
mod weak;
mod wide;

//! The `--device` option.

use clap::Args;
use yawrig_base::error::Result;
use yawrig_link::bench::{Bench, Target};
use yawrig_link::image;

#[derive(Args, Debug, Clone)]
pub struct DeviceArg {
    /// `emulated` (the firmware in this process), `qemu` (the ARM image on an emulated
    /// Cortex-M4F) or a serial port's path
    #[arg(short, long, value_name = "DEVICE", default_value = "emulated", global = true)]
    pub device: Target,
}

impl DeviceArg {
    /// Starts or opens it; where it is emulated, says where another shell finds it.
    pub fn open(&self) -> Result<Bench> {
        if self.device == Target::Qemu && image::takes_a_minute() {
            crate::say!("building the ARM image (the first time takes a minute)");
        }
        let bench = Bench::open(&self.device)?;
        if !matches!(self.device, Target::Port(_)) {
            crate::say!(
                "device: {} at {path}; from another shell: yawrig monitor --device {path}",
                self.device,
                path = bench.shared_path()
            );
        }
        Ok(bench)
    }
}

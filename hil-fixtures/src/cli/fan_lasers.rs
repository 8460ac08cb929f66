//! Which lasers of today a rig has: the rig says what they speak, these options their type.

use crate::devices::cola::ColaParams;
use crate::devices::scip::ScipParams;

/// Types of the lasers that are no LMS 2xx.
#[derive(Debug, clap::Args)]
pub(super) struct FanLaserTypes {
    /// Type of the lasers that the rig has on the network, as they leave the factory: LMS111, LMS511, TIM561,
    /// TIM781, or another name of these families.
    #[arg(long, value_name = "TYPE", default_value = "LMS111", value_parser = network_laser)]
    pub(super) network_laser: ColaParams,
    /// Type of the Hokuyo lasers that the rig has: UST-10LX, UST-20LX, UTM-30LX, UTM-30LX-EW, UXM-30LX-E or
    /// URG-04LX.
    #[arg(long, value_name = "TYPE", default_value = "UST-20LX", value_parser = hokuyo)]
    pub(super) hokuyo: ScipParams,
}

fn network_laser(text: &str) -> Result<ColaParams, String> {
    ColaParams::of_name(text).ok_or_else(|| "expected LMS1.., LMS5.., TIM5.. or TIM7..".to_owned())
}

fn hokuyo(text: &str) -> Result<ScipParams, String> {
    let known = "expected UST-10LX, UST-20LX, UTM-30LX, UTM-30LX-EW, UXM-30LX-E or URG-04LX";
    ScipParams::of_name(text).ok_or_else(|| known.to_owned())
}

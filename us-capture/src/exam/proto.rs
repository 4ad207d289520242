//! The messages of `probepath.proto` as Rust types; a test holds each field against the text.
//!
//! Scalars are `required` here so that they are always on the wire, as proto3 allows: prost leaves out what equals the
//! default, and -0.0 equals 0.0, so a sign would be lost.

/// `probepath.Pose`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Pose {
    #[prost(string, tag = "1")]
    pub(crate) written_in: String,
    #[prost(string, tag = "2")]
    pub(crate) of: String,
    #[prost(double, required, tag = "3")]
    pub(crate) x_m: f64,
    #[prost(double, required, tag = "4")]
    pub(crate) y_m: f64,
    #[prost(double, required, tag = "5")]
    pub(crate) z_m: f64,
    #[prost(double, required, tag = "6")]
    pub(crate) qx: f64,
    #[prost(double, required, tag = "7")]
    pub(crate) qy: f64,
    #[prost(double, required, tag = "8")]
    pub(crate) qz: f64,
    #[prost(double, required, tag = "9")]
    pub(crate) qw: f64,
}

/// `probepath.Wrench`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Wrench {
    #[prost(string, tag = "1")]
    pub(crate) written_in: String,
    #[prost(double, required, tag = "2")]
    pub(crate) force_x_n: f64,
    #[prost(double, required, tag = "3")]
    pub(crate) force_y_n: f64,
    #[prost(double, required, tag = "4")]
    pub(crate) force_z_n: f64,
    #[prost(double, required, tag = "5")]
    pub(crate) torque_x_nm: f64,
    #[prost(double, required, tag = "6")]
    pub(crate) torque_y_nm: f64,
    #[prost(double, required, tag = "7")]
    pub(crate) torque_z_nm: f64,
}

/// `probepath.Tick`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Tick {
    #[prost(fixed64, required, tag = "1")]
    pub(crate) tick: u64,
    #[prost(sfixed64, required, tag = "2")]
    pub(crate) stamp_ns: i64,
    #[prost(bool, required, tag = "3")]
    pub(crate) stay: bool,
    #[prost(double, repeated, tag = "4")]
    pub(crate) command: Vec<f64>,
    #[prost(double, repeated, tag = "5")]
    pub(crate) position: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    pub(crate) velocity: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    pub(crate) commanded: Vec<f64>,
    #[prost(message, optional, tag = "8")]
    pub(crate) wrench: Option<Wrench>,
    #[prost(bool, required, tag = "9")]
    pub(crate) guiding: bool,
    #[prost(string, tag = "10")]
    pub(crate) phase: String,
    #[prost(message, optional, tag = "11")]
    pub(crate) world_from_probe: Option<Pose>,
    // Not `required`: where all is as it should be they take no room, and older exams read as that.
    #[prost(string, tag = "12")]
    pub(crate) safety: String,
    #[prost(bool, tag = "13")]
    pub(crate) freedrive: bool,
    #[prost(sfixed64, tag = "14")]
    pub(crate) age_ns: i64,
    #[prost(bool, tag = "15")]
    pub(crate) overtaken: bool,
}

/// `probepath.BScan`.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct BScan {
    #[prost(fixed64, required, tag = "1")]
    pub(crate) number: u64,
    #[prost(sfixed64, required, tag = "2")]
    pub(crate) formed_ns: i64,
    #[prost(sfixed64, required, tag = "3")]
    pub(crate) arrived_ns: i64,
    #[prost(double, required, tag = "4")]
    pub(crate) depth_m: f64,
    #[prost(double, required, tag = "5")]
    pub(crate) focus_m: f64,
    #[prost(double, required, tag = "6")]
    pub(crate) window_top_m: f64,
    #[prost(double, required, tag = "7")]
    pub(crate) window_height_m: f64,
    #[prost(double, required, tag = "8")]
    pub(crate) window_width_m: f64,
    #[prost(double, required, tag = "9")]
    pub(crate) spacing_x_m: f64,
    #[prost(double, required, tag = "10")]
    pub(crate) spacing_y_m: f64,
    #[prost(uint32, required, tag = "11")]
    pub(crate) width: u32,
    #[prost(uint32, required, tag = "12")]
    pub(crate) height: u32,
    #[prost(message, optional, tag = "13")]
    pub(crate) world_from_probe: Option<Pose>,
    #[prost(message, optional, tag = "14")]
    pub(crate) world_from_image: Option<Pose>,
    #[prost(message, optional, tag = "15")]
    pub(crate) wrench: Option<Wrench>,
}

//! The `ros2msg` texts of every message type in our files, each complete with all types that it is made of.
//!
//! Format (MCAP registry, "ros2msg"): the type's own definition, then for every type it is made of, directly
//! or not, a line of 80 `=`, a line `MSG: package/Type` and its definition. Readers refuse a text that lacks
//! one. Source: ROS 2 common interfaces (Humble and later agree).

const TIME: &str = "int32 sec\nuint32 nanosec";
const HEADER: &str = "builtin_interfaces/Time stamp\nstring frame_id";
const POINT: &str = "float64 x\nfloat64 y\nfloat64 z";
const QUATERNION: &str = "float64 x\nfloat64 y\nfloat64 z\nfloat64 w";
const POSE: &str = "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation";
const POSE_WITH_COVARIANCE: &str = "geometry_msgs/Pose pose\nfloat64[36] covariance";
const TWIST: &str = "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular";
const TWIST_WITH_COVARIANCE: &str = "geometry_msgs/Twist twist\nfloat64[36] covariance";
const TRANSFORM: &str = "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation";
const TRANSFORM_STAMPED: &str =
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform";
const DIAGNOSTIC_STATUS: &str = "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n\
     string hardware_id\ndiagnostic_msgs/KeyValue[] values";
const KEY_VALUE: &str = "string key\nstring value";
const LAYOUT: &str = "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset";
const DIMENSION: &str = "string label\nuint32 size\nuint32 stride";

const LASER_SCAN: &str = "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n\
     float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities";
const ODOMETRY: &str = "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
     geometry_msgs/TwistWithCovariance twist";
const IMU: &str = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
     geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
     geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance";
const POSE_STAMPED: &str = "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose";
const TF_MESSAGE: &str = "geometry_msgs/TransformStamped[] transforms";
const DIAGNOSTIC_ARRAY: &str = "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status";
const OCCUPANCY_GRID: &str = "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data";
const MAP_META_DATA: &str = "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\ngeometry_msgs/Pose origin";
const POINT_CLOUD2: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n\
     uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense";
const POINT_FIELD: &str = "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n\
     uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count";
const MARKER_ARRAY: &str = "visualization_msgs/Marker[] markers";
const MARKER: &str = "int32 ARROW=0\nint32 CUBE=1\nint32 SPHERE=2\nint32 CYLINDER=3\nint32 LINE_STRIP=4\nint32 LINE_LIST=5\n\
     int32 CUBE_LIST=6\nint32 SPHERE_LIST=7\nint32 POINTS=8\nint32 TEXT_VIEW_FACING=9\nint32 MESH_RESOURCE=10\n\
     int32 TRIANGLE_LIST=11\nint32 ARROW_STRIP=12\nint32 ADD=0\nint32 MODIFY=0\nint32 DELETE=2\nint32 DELETEALL=3\n\
     std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n\
     geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool frame_locked\n\
     geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n\
     sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n\
     string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials";
const COLOR_RGBA: &str = "float32 r\nfloat32 g\nfloat32 b\nfloat32 a";
const COMPRESSED_IMAGE: &str = "std_msgs/Header header\nstring format\nuint8[] data";
const UV_COORDINATE: &str = "float32 u\nfloat32 v";
const MESH_FILE: &str = "string filename\nuint8[] data";
const UINT8_MULTI_ARRAY: &str = "std_msgs/MultiArrayLayout layout\nuint8[] data";

/// One type inside another: its name as `MSG:` wants it, and its definition.
type Part = (&'static str, &'static str);

const STAMPED: [Part; 2] = [("std_msgs/Header", HEADER), ("builtin_interfaces/Time", TIME)];
const POSE_PARTS: [Part; 4] = [
    ("geometry_msgs/PoseWithCovariance", POSE_WITH_COVARIANCE),
    ("geometry_msgs/Pose", POSE),
    ("geometry_msgs/Point", POINT),
    ("geometry_msgs/Quaternion", QUATERNION),
];
const TWIST_PARTS: [Part; 3] = [
    ("geometry_msgs/TwistWithCovariance", TWIST_WITH_COVARIANCE),
    ("geometry_msgs/Twist", TWIST),
    ("geometry_msgs/Vector3", POINT),
];
const IMU_PARTS: [Part; 2] = [("geometry_msgs/Quaternion", QUATERNION), ("geometry_msgs/Vector3", POINT)];
const TRANSFORM_STAMPED_PART: [Part; 1] = [("geometry_msgs/TransformStamped", TRANSFORM_STAMPED)];
const TRANSFORM_PARTS: [Part; 3] = [
    ("geometry_msgs/Transform", TRANSFORM),
    ("geometry_msgs/Vector3", POINT),
    ("geometry_msgs/Quaternion", QUATERNION),
];
const DIAGNOSTIC_PARTS: [Part; 2] =
    [("diagnostic_msgs/DiagnosticStatus", DIAGNOSTIC_STATUS), ("diagnostic_msgs/KeyValue", KEY_VALUE)];
const MAP_PARTS: [Part; 4] = [
    ("nav_msgs/MapMetaData", MAP_META_DATA),
    ("geometry_msgs/Pose", POSE),
    ("geometry_msgs/Point", POINT),
    ("geometry_msgs/Quaternion", QUATERNION),
];
const POINT_CLOUD_PARTS: [Part; 1] = [("sensor_msgs/PointField", POINT_FIELD)];
const MARKER_PARTS: [Part; 9] = [
    ("visualization_msgs/Marker", MARKER),
    ("geometry_msgs/Pose", POSE),
    ("geometry_msgs/Point", POINT),
    ("geometry_msgs/Quaternion", QUATERNION),
    ("geometry_msgs/Vector3", POINT),
    ("std_msgs/ColorRGBA", COLOR_RGBA),
    ("sensor_msgs/CompressedImage", COMPRESSED_IMAGE),
    ("visualization_msgs/UVCoordinate", UV_COORDINATE),
    ("visualization_msgs/MeshFile", MESH_FILE),
];
const DURATION_PART: [Part; 1] = [("builtin_interfaces/Duration", TIME)];
const LAYOUT_PARTS: [Part; 2] =
    [("std_msgs/MultiArrayLayout", LAYOUT), ("std_msgs/MultiArrayDimension", DIMENSION)];

/// The complete `ros2msg` text of a type that Biplane writes or shows (`package/msg/Type`); `None` for
/// another.
#[must_use]
pub fn ros2msg(type_name: &str) -> Option<String> {
    let (own, groups): (&str, &[&[Part]]) = match type_name {
        "sensor_msgs/msg/LaserScan" => (LASER_SCAN, &[&STAMPED]),
        "nav_msgs/msg/Odometry" => (ODOMETRY, &[&STAMPED, &POSE_PARTS, &TWIST_PARTS]),
        "sensor_msgs/msg/Imu" => (IMU, &[&STAMPED, &IMU_PARTS]),
        "geometry_msgs/msg/PoseWithCovarianceStamped" => (POSE_STAMPED, &[&STAMPED, &POSE_PARTS]),
        "tf2_msgs/msg/TFMessage" => (TF_MESSAGE, &[&TRANSFORM_STAMPED_PART, &STAMPED, &TRANSFORM_PARTS]),
        "diagnostic_msgs/msg/DiagnosticArray" => (DIAGNOSTIC_ARRAY, &[&STAMPED, &DIAGNOSTIC_PARTS]),
        "nav_msgs/msg/OccupancyGrid" => (OCCUPANCY_GRID, &[&STAMPED, &MAP_PARTS]),
        "sensor_msgs/msg/PointCloud2" => (POINT_CLOUD2, &[&STAMPED, &POINT_CLOUD_PARTS]),
        "visualization_msgs/msg/MarkerArray" => (MARKER_ARRAY, &[&MARKER_PARTS, &DURATION_PART, &STAMPED]),
        "std_msgs/msg/UInt8MultiArray" => (UINT8_MULTI_ARRAY, &[&LAYOUT_PARTS]),
        _ => return None,
    };
    let mut text = format!("{own}\n");
    for (name, definition) in groups.iter().flat_map(|group| group.iter()) {
        text.push_str(&"=".repeat(80));
        text.push_str(&format!("\nMSG: {name}\n{definition}\n"));
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::ros2msg;
    use crate::topics::Topic;
    use std::collections::BTreeSet;

    /// Types named by the fields of a definition: the words with a slash at a line's start.
    fn named(text: &str) -> BTreeSet<&str> {
        text.lines()
            .filter(|line| !line.starts_with("MSG: "))
            .filter_map(|line| line.split(' ').next())
            .map(|word| word.trim_end_matches("[]"))
            .filter(|word| word.contains('/'))
            .collect()
    }

    #[test]
    fn every_type_has_a_schema_that_defines_exactly_the_types_it_names() {
        let shown = [
            "nav_msgs/msg/OccupancyGrid",
            "sensor_msgs/msg/PointCloud2",
            "visualization_msgs/msg/MarkerArray",
        ];
        for name in Topic::ALL.map(Topic::type_name).into_iter().chain(shown) {
            let text = ros2msg(name).unwrap_or_else(|| panic!("{name} has none"));
            let defined: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
            let unique: BTreeSet<&str> = defined.iter().copied().collect();
            assert_eq!(unique.len(), defined.len(), "a type is defined twice:\n{text}");
            assert_eq!(unique, named(&text), "{text}");
        }
    }

    #[test]
    fn a_laser_scan_reads_as_other_programs_write_it() {
        let equals = "=".repeat(80);
        let expected = format!(
            "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n\
             float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n{equals}\n\
             MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{equals}\n\
             MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
        );
        assert_eq!(ros2msg("sensor_msgs/msg/LaserScan").as_deref(), Some(expected.as_str()));
        assert_eq!(ros2msg("sensor_msgs/LaserScan"), None);
    }
}

#include "analysis/logs/formats/ros_messages.h"

namespace swarmcert::logs {
namespace {

struct BuiltinMessage {
  std::string_view name;
  RosMessageText definition;
};

// Sources: the interface packages common_interfaces, geometry2, crazyswarm2, motion_capture_tracking and px4_msgs. For
// px4_msgs, only the fields shared by firmware versions 1.12 to 1.16.
constexpr BuiltinMessage kBuiltinMessages[] = {
    {"builtin_interfaces/Time", {"int32 sec\nuint32 nanosec\n"}},
    {"builtin_interfaces/Duration", {"int32 sec\nuint32 nanosec\n"}},
    {"std_msgs/Header", {"builtin_interfaces/Time stamp\nstring frame_id\n"}},
    {"std_msgs/Float32", {"float32 data\n"}},
    {"std_msgs/Float64", {"float64 data\n"}},
    {"geometry_msgs/Point", {"float64 x\nfloat64 y\nfloat64 z\n"}},
    {"geometry_msgs/Vector3", {"float64 x\nfloat64 y\nfloat64 z\n"}},
    {"geometry_msgs/Quaternion", {"float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"}},
    {"geometry_msgs/Pose", {"Point position\nQuaternion orientation\n"}},
    {"geometry_msgs/Twist", {"Vector3 linear\nVector3 angular\n"}},
    {"geometry_msgs/Accel", {"Vector3 linear\nVector3 angular\n"}},
    {"geometry_msgs/Wrench", {"Vector3 force\nVector3 torque\n"}},
    {"geometry_msgs/Transform", {"Vector3 translation\nQuaternion rotation\n"}},
    {"geometry_msgs/PoseWithCovariance", {"Pose pose\nfloat64[36] covariance\n"}},
    {"geometry_msgs/TwistWithCovariance", {"Twist twist\nfloat64[36] covariance\n"}},
    {"geometry_msgs/PointStamped", {"std_msgs/Header header\nPoint point\n"}},
    {"geometry_msgs/PoseStamped", {"std_msgs/Header header\nPose pose\n"}},
    {"geometry_msgs/PoseWithCovarianceStamped", {"std_msgs/Header header\nPoseWithCovariance pose\n"}},
    {"geometry_msgs/TwistStamped", {"std_msgs/Header header\nTwist twist\n"}},
    {"geometry_msgs/AccelStamped", {"std_msgs/Header header\nAccel accel\n"}},
    {"geometry_msgs/WrenchStamped", {"std_msgs/Header header\nWrench wrench\n"}},
    {"geometry_msgs/Vector3Stamped", {"std_msgs/Header header\nVector3 vector\n"}},
    {"geometry_msgs/QuaternionStamped", {"std_msgs/Header header\nQuaternion quaternion\n"}},
    {"geometry_msgs/TransformStamped",
     {"std_msgs/Header header\nstring child_frame_id\nTransform transform\n"}},
    {"tf2_msgs/TFMessage", {"geometry_msgs/TransformStamped[] transforms\n"}},
    {"nav_msgs/Odometry",
     {"std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
      "geometry_msgs/TwistWithCovariance twist\n"}},
    {"sensor_msgs/Imu",
     {"std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
      "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
      "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"}},
    {"sensor_msgs/BatteryState",
     {"std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\n"
      "float32 capacity\nfloat32 design_capacity\nfloat32 percentage\n",
      true}},
    {"crazyflie_interfaces/LogDataGeneric", {"std_msgs/Header header\nuint32 timestamp\nfloat32[] values\n"}},
    {"crazyflie_interfaces/LogDataGeneric", {"std_msgs/Header header\nuint32 timestamp\nfloat64[] values\n"}},
    {"crazyflie_interfaces/FullState",
     {"std_msgs/Header header\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\ngeometry_msgs/Vector3 "
      "acc\n"}},
    {"motion_capture_tracking_interfaces/NamedPose", {"string name\ngeometry_msgs/Pose pose\n"}},
    {"motion_capture_tracking_interfaces/NamedPoseArray", {"std_msgs/Header header\nNamedPose[] poses\n"}},
    {"px4_msgs/VehicleLocalPosition",
     {"uint64 timestamp\nuint64 timestamp_sample\nbool xy_valid\nbool z_valid\nbool v_xy_valid\nbool "
      "v_z_valid\n"
      "float32 x\nfloat32 y\nfloat32 z\nfloat32[2] delta_xy\nuint8 xy_reset_counter\nfloat32 delta_z\n"
      "uint8 z_reset_counter\nfloat32 vx\nfloat32 vy\nfloat32 vz\nfloat32 z_deriv\nfloat32[2] delta_vxy\n"
      "uint8 vxy_reset_counter\nfloat32 delta_vz\nuint8 vz_reset_counter\nfloat32 ax\nfloat32 ay\nfloat32 "
      "az\n"
      "float32 heading\n",
      true}},
    {"px4_msgs/VehicleAttitude",
     {"uint64 timestamp\nuint64 timestamp_sample\nfloat32[4] q\nfloat32[4] delta_q_reset\n"
      "uint8 quat_reset_counter\n"}},
    {"px4_msgs/SensorCombined",
     {"uint64 timestamp\nfloat32[3] gyro_rad\nuint32 gyro_integral_dt\nint32 "
      "accelerometer_timestamp_relative\n"
      "float32[3] accelerometer_m_s2\nuint32 accelerometer_integral_dt\n",
      true}},
    {"px4_msgs/ActuatorMotors",
     {"uint64 timestamp\nuint64 timestamp_sample\nuint16 reversible_flags\nfloat32[12] control\n"}},
    {"px4_msgs/BatteryStatus", {"uint64 timestamp\nbool connected\nfloat32 voltage_v\n", true}},
};

}  // namespace

std::vector<RosMessageText> builtin_ros_definitions(const std::string& name) {
  std::vector<RosMessageText> found;
  for (const BuiltinMessage& message : kBuiltinMessages)
    if (message.name == name) found.push_back(message.definition);
  return found;
}

}  // namespace swarmcert::logs

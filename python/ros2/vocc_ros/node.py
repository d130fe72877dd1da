"""The node: subscribes to images and a calibration, publishes what vocc_ros.reception gives."""

from array import array
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header, MultiArrayLayout, String, UInt8MultiArray

from vocc_ros.reception import PARAMETERS, ImageReceiver, Publication, Types, topics

TYPES = Types(
    Time=Time,
    Header=Header,
    String=String,
    UInt8MultiArray=UInt8MultiArray,
    MultiArrayLayout=MultiArrayLayout,
    PoseWithCovarianceStamped=PoseWithCovarianceStamped,
    PoseWithCovariance=PoseWithCovariance,
    Pose=Pose,
    Point=Point,
    Quaternion=Quaternion,
    DiagnosticArray=DiagnosticArray,
    DiagnosticStatus=DiagnosticStatus,
    KeyValue=KeyValue,
    byte=lambda number: bytes([number]),
    octets=lambda data: array("B", data),
)


class ReceiverNode(Node):
    """Receives messages of LED panels from an image topic."""

    def __init__(self) -> None:
        super().__init__("vocc_receiver")
        parameters: dict[str, Any] = {}
        for name, parameter in PARAMETERS.items():
            # A number may be given without its decimal point.
            descriptor = ParameterDescriptor(description=parameter.about, dynamic_typing=True)
            parameters[name] = self.declare_parameter(name, parameter.default, descriptor).value
        compressed = self.declare_parameter("compressed", False, ParameterDescriptor(description="whether to read image/compressed")).value
        self.receiver = ImageReceiver(parameters, TYPES, lambda: self.get_clock().now().nanoseconds, self.say)
        self.outputs = {
            topic: self.create_publisher(getattr(TYPES, kind), topic, 10)
            for topic, kind in topics(self.receiver.settings["panels"]).items()
        }
        if compressed:
            self.create_subscription(CompressedImage, "image/compressed", self.take_compressed, qos_profile_sensor_data)
        else:
            self.create_subscription(Image, "image", self.take_image, qos_profile_sensor_data)
        self.create_subscription(CameraInfo, "camera_info", self.receiver.camera_info, qos_profile_sensor_data)
        self.create_timer(1.0, self.take_silence)

    def say(self, level: str, text: str) -> None:
        # rclpy refuses two levels from one line.
        if level == "error":
            self.get_logger().error(text)
        elif level == "warn":
            self.get_logger().warning(text)
        else:
            self.get_logger().info(text)

    def publish(self, publications: list[Publication]) -> None:
        for publication in publications:
            self.outputs[publication.topic].publish(publication.message)

    def take_image(self, message: Image) -> None:
        self.publish(self.receiver.image(message))

    def take_compressed(self, message: CompressedImage) -> None:
        self.publish(self.receiver.compressed(message))

    def take_silence(self) -> None:
        self.publish(self.receiver.silence())


def main() -> None:
    rclpy.init()
    node = ReceiverNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if rclpy.ok():
            node.publish(node.receiver.finish())
        node.destroy_node()
        rclpy.try_shutdown()

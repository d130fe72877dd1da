"""Starts the receiver on a camera's topics: ros2 launch vocc_ros receiver.launch.py image:=/camera/image_raw"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    topics = [
        DeclareLaunchArgument("image", default_value="/camera/image_raw", description="Topic of the images"),
        DeclareLaunchArgument("camera_info", default_value="/camera/camera_info", description="Topic of the calibration"),
    ]
    numbers = [
        DeclareLaunchArgument("symbol_rate", default_value="-1.0", description="Symbols a second; -1: found"),
        DeclareLaunchArgument("interval", default_value="-1.0", description="Gap between LEDs over their diameter; -1: not given"),
        DeclareLaunchArgument("led_diameter_m", default_value="-1.0", description="Diameter of an LED in metres; -1: not given"),
    ]
    switches = [
        DeclareLaunchArgument("compressed", default_value="false", description="Whether to read the image topic's /compressed"),
        DeclareLaunchArgument("rectified", default_value="false", description="Whether images are rectified"),
    ]

    def values(arguments: list[DeclareLaunchArgument], of: type) -> dict[str, ParameterValue]:
        return {argument.name: ParameterValue(LaunchConfiguration(argument.name), value_type=of) for argument in arguments}

    receiver = Node(
        package="vocc_ros",
        executable="receiver",
        name="vocc_receiver",
        parameters=[values(numbers, float) | values(switches, bool)],
        remappings=[
            ("image", LaunchConfiguration("image")),
            ("image/compressed", [LaunchConfiguration("image"), "/compressed"]),
            ("camera_info", LaunchConfiguration("camera_info")),
        ],
        output="screen",
    )
    return LaunchDescription([*topics, *numbers, *switches, receiver])

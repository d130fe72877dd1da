from setuptools import setup

PACKAGE = "vocc_ros"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Optical camera communication between vehicles: messages and poses of LED panels from an image topic",
    license="MIT OR Apache-2.0",
    packages=[PACKAGE],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", ["launch/receiver.launch.py"]),
    ],
    install_requires=["setuptools", "numpy"],
    zip_safe=True,
    entry_points={"console_scripts": [f"receiver = {PACKAGE}.node:main"]},
)

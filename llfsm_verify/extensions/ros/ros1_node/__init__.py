"""The child of a port of the kind `ros1`. It runs under the Python that has rospy, 3.8 or newer, without our code."""

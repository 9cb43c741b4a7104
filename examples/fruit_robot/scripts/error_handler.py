#!/usr/bin/env python3
"""Sets the state of the state machine when a fruit was dropped: it takes a new image, and the arm stops."""

import subprocess

import rospy
from std_msgs.msg import Empty


def main():
    rospy.init_node("error_handler")
    llfsm, whiteboard = rospy.get_param("~llfsm", "llfsm"), rospy.get_param("~whiteboard", "fruit_robot")

    def dropped(_):
        subprocess.run([llfsm, "send", whiteboard, "enter", "picker", "Locate_fruits"], check=True)

    rospy.Subscriber("fruit_dropped", Empty, dropped)
    rospy.spin()


main()

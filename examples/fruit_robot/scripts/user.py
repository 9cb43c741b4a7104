#!/usr/bin/env python3
"""Says when to start, each time that the robot is ready, and pauses it once, for a while."""

import threading

import rospy
from std_msgs.msg import Bool, String


def main():
    rospy.init_node("user")
    start = rospy.Publisher("sm_ready_msg", String, queue_size=10)
    pause = rospy.Publisher("pause", Bool, queue_size=10, latch=True)
    moves = threading.Semaphore(0)

    def shows(state):
        if state.data == "Ready":
            start.publish("Start state machine")
        elif state.data == "Pick_fruit":
            moves.release()

    while start.get_num_connections() == 0:  # else nobody hears it
        rospy.rostime.wallsleep(0.01)
    rospy.Subscriber("current_state", String, shows)
    pause.publish(False)
    for _ in range(rospy.get_param("~pause_after", 4)):  # fruits
        moves.acquire()
    rospy.rostime.wallsleep(0.05)  # the arm moves
    pause.publish(True)
    rospy.rostime.wallsleep(rospy.get_param("~pause", 1.0))
    pause.publish(False)
    rospy.spin()


main()

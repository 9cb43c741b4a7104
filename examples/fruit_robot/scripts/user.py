#!/usr/bin/env python3
"""Says when to start, each time that the robot is ready, and pauses it once, some fruits after one was dropped."""

import threading

import rospy
from std_msgs.msg import Bool, Empty, String

SUSPENDED = "__suspend"
"""What the state machine's state is called in a pause."""


class Robot:
    """What its topics have told."""

    def __init__(self):
        self.state, self.moves, self.dropped = "", 0, False
        self._told = threading.Condition()
        rospy.Subscriber("current_state", String, self._shows)
        rospy.Subscriber("fruit_dropped", Empty, self._drops)

    def _shows(self, state):
        with self._told:
            self.state = state.data
            self.moves += state.data == "Pick_fruit"
            self._told.notify_all()

    def _drops(self, _):
        with self._told:
            self.dropped = True
            self._told.notify_all()

    def wait(self, condition):
        """Wait until that is so, or the node ends."""
        with self._told:
            while not condition():
                if rospy.is_shutdown():
                    raise SystemExit
                self._told.wait(0.1)

    def picks(self, count):
        """Wait until it has moved to so many fruits from now on."""
        last = self.moves + count
        self.wait(lambda: self.moves >= last)


def main():
    rospy.init_node("user")
    start = rospy.Publisher("sm_ready_msg", String, queue_size=10)
    pause = rospy.Publisher("pause", Bool, queue_size=10, latch=True)
    pause.publish(False)
    robot = Robot()

    def starts():
        while not rospy.is_shutdown():
            if robot.state == "Ready":
                start.publish("Start state machine")
            rospy.rostime.wallsleep(0.1)

    threading.Thread(target=starts, daemon=True).start()
    robot.wait(lambda: robot.dropped)
    robot.picks(rospy.get_param("~pause_after", 4))
    rospy.rostime.wallsleep(0.05)  # the arm moves
    pause.publish(True)
    robot.wait(lambda: robot.state == SUSPENDED)
    rospy.rostime.wallsleep(rospy.get_param("~pause", 1.0))
    pause.publish(False)
    count = rospy.get_param("~then", 0)
    robot.picks(count)
    if not count:
        rospy.spin()


main()

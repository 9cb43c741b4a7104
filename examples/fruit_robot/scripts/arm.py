#!/usr/bin/env python3
"""Moves to fruits and to the basket, does not reach each seventh one, and drops a fruit on its way."""

import itertools

import actionlib
import rospy
from fruit_robot.msg import moveArmAction, moveArmFeedback, moveArmResult
from std_msgs.msg import Empty

STEPS = 5


def main():
    rospy.init_node("arm")
    seconds = rospy.get_param("~seconds", 0.1)  # of a move
    drops = rospy.get_param("~drops", 9)  # which one
    fruits, baskets = itertools.count(1), itertools.count(1)
    dropped = rospy.Publisher("fruit_dropped", Empty, queue_size=1, latch=True)

    def move(goal):
        last = STEPS
        if goal.place == "FRUIT":
            reached = next(fruits) % 7 != 0
        else:
            reached = True
            if next(baskets) == drops:
                last = 1000 * STEPS  # it looks for the fruit on the ground until the goal is cancelled
                dropped.publish()
        for step in range(last):
            server.publish_feedback(moveArmFeedback(step >= STEPS - 2))
            rospy.rostime.wallsleep(seconds / STEPS)
            if server.is_preempt_requested() or (step == STEPS - 2 and not reached):
                server.set_preempted(moveArmResult(goal.place))
                return
        server.set_succeeded(moveArmResult(goal.place))

    server = actionlib.SimpleActionServer("move_box_arm_action", moveArmAction, move, auto_start=False)
    server.start()
    rospy.spin()


main()

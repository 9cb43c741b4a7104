#!/usr/bin/env python3
"""Sees fruits, and fails one time in five."""

import itertools

import rospy
from fruit_robot.msg import Fruit
from fruit_robot.srv import Fruits_req, Fruits_reqResponse

IMAGES = (2, 1, 0, 2)
"""How many fruits are in one image after the other, and then again."""


def main():
    rospy.init_node("localisation")
    seconds = rospy.get_param("~seconds", 0.02)  # of image analysis
    numbers, images = itertools.count(1), itertools.cycle(IMAGES)

    def locate(_):
        rospy.rostime.wallsleep(seconds)
        if next(numbers) % 5 == 0:
            raise rospy.ServiceException("the image is too dark")
        return Fruits_reqResponse([Fruit(0.5, 0.25 * number, 1.0) for number in range(next(images))])

    rospy.Service("fruit_request", Fruits_req, locate)
    rospy.spin()


main()

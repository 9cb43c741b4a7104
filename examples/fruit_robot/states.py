"""The same robot with its states in Python, as the thesis has them, by a transition file of CROPS.

It needs a Python that has both rospy and llfsm-verify. `python show.py --states` runs it beside the nodes.
"""

import sys
import threading
from pathlib import Path

import actionlib
import rospy
from fruit_robot.msg import moveArmAction, moveArmGoal
from fruit_robot.srv import Fruits_req
from std_msgs.msg import Bool, Empty, String

from llfsm_verify.extensions.crops import SimpleActionState, State, StateMachine


class Ready(State):
    """Waits for a message (3.3.1)."""

    outcomes = ("Waiting", "Start state machine")

    def __init__(self):
        self.said = threading.Event()
        rospy.Subscriber("sm_ready_msg", String, lambda said: self.said.set() if said.data in self.outcomes else None)

    def execute(self, _):
        if not self.said.is_set():
            return "Waiting"
        self.said.clear()
        return "Start state machine"


class LocateFruits(State):
    """Asks a service; nothing else waits while the call blocks (3.3.2)."""

    outcomes = ("No_fruit_detected", "Found_fruit")

    def __init__(self):
        rospy.wait_for_service("fruit_request")
        self.ask = rospy.ServiceProxy("fruit_request", Fruits_req)

    def execute(self, data):
        try:
            data["fruits"] = len(self.ask().fruit_list)
        except rospy.ServiceException:
            return "No_fruit_detected"
        return "Found_fruit"


class SelectFruit(State):
    """Takes the last one, until none is left or the basket is full."""

    outcomes = ("Fruit selected", "All fruits picked", "Basket is full")

    def execute(self, data):
        if data["in_basket"] >= data["wanted"]:
            return "Basket is full"
        if data["fruits"] == 0:
            return "All fruits picked"
        data["fruits"] -= 1
        return "Fruit selected"


class Move(SimpleActionState):
    """A goal of the arm (3.3.3): a place, and which fruit."""

    def __init__(self, client, place, *, ends, otherwise):
        super().__init__("move_box_arm_action", client, ends=ends, otherwise=otherwise)
        self.place = place

    def goal(self, data):
        return moveArmGoal(self.place, data["fruits"])

    def done(self, result, data):
        data["in_basket"] += result.place == "BASKET"


def main():
    """Fill the basket with as many fruits as the first argument says, and record the run in the second."""
    wanted, recording = rospy.myargv()[1:]
    rospy.init_node("fruit_picker", disable_signals=True)
    arm = actionlib.SimpleActionClient("move_box_arm_action", moveArmAction)
    arm.wait_for_server()
    sm = StateMachine(["Exit"])
    sm.add_transition_file(Path(__file__).with_name("transfile.yaml"))
    sm.add("Ready", Ready())
    sm.add("Locate_fruits", LocateFruits())
    sm.add("Select_fruit", SelectFruit())
    reach = {"SUCCEEDED": "Goal", "PREEMPTED": "Out of reach"}
    sm.add("Pick_fruit", Move(arm, "FRUIT", ends=reach, otherwise="Moving to fruit"))
    sm.add("Fruit_to_basket", Move(arm, "BASKET", ends={"SUCCEEDED": "Basket"}, otherwise="Transport fruit"))
    shown = rospy.Publisher("current_state", String, queue_size=10, latch=True)
    counts = {"pauses": 0, "changes": 0}

    def pause(said):
        if said.data:
            sm.pause()
            counts["pauses"] += 1
            shown.publish("__suspend")
        elif counts["pauses"]:
            sm.resume()

    def drop(_):
        sm.change_state("Locate_fruits")
        counts["changes"] += 1

    def show():
        last = None
        while True:
            label = sm.current[0] if sm.current else None
            if label is not None and label != last:
                shown.publish(label)
            last = label
            rospy.rostime.wallsleep(0.01)

    threading.Thread(target=show, daemon=True).start()
    rospy.Subscriber("pause", Bool, pause)
    rospy.Subscriber("fruit_dropped", Empty, drop)
    data = {"fruits": 0, "in_basket": 0, "wanted": int(wanted)}
    end = sm.execute("Ready", data=data, record=recording)
    print(f"{end}: {wanted} fruits in the basket, pauses {counts['pauses']}, changes of state {counts['changes']}")


if __name__ == "__main__":
    sys.exit(main())

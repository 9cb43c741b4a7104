"""rospy's side of `benchmarks.running`; runs in the system's Python, which has rospy, and imports nothing of ours.

`python3 rospeer.py publish TIMES`: prints seconds of one `publish` with a subscriber in another process, which it
starts; `python3 rospeer.py latency TIMES`: prints, for each message, nanoseconds from before `publish` to the
subscriber's call-back; `python3 rospeer.py relayed TIMES`: the same where a node between the two looks at each message,
as the monitors of ROSRV do, and sends it on. A master must run at ROS_MASTER_URI.
"""

import subprocess
import sys
import time

import rospy
from std_msgs.msg import String

TOPIC, WATCHED = "llfsm_benchmark", "llfsm_watched"
PAUSE = 0.001
"""Seconds between two messages whose way is timed: each arrives before the next one is sent."""


def publish(times: int, pause: float, *, relayed: bool = False) -> None:
    rospy.init_node("llfsm_publisher", disable_signals=True)
    publisher = rospy.Publisher(WATCHED if relayed else TOPIC, String, queue_size=1000)
    child = subprocess.Popen([sys.executable, __file__, "listen", str(times)], stdout=subprocess.PIPE, text=True)
    between = subprocess.Popen([sys.executable, __file__, "relay", "0"]) if relayed else None
    try:
        while not publisher.get_num_connections():
            time.sleep(0.01)
        begin = time.perf_counter()
        for _ in range(times):
            publisher.publish(str(time.monotonic_ns()))
            if pause:
                time.sleep(pause)
        seconds = (time.perf_counter() - begin) / times
        publisher.publish("")
        told, _ = child.communicate(timeout=60)
    finally:
        for process in (child, between):
            if process is not None:
                process.kill()
                process.wait()
    print(told if pause else seconds)


def listen(times: int) -> None:
    rospy.init_node("llfsm_subscriber", disable_signals=True)
    found = []
    over = False

    def heard(message: String) -> None:
        nonlocal over
        now = time.monotonic_ns()
        if message.data:
            found.append(now - int(message.data))
        else:
            over = True

    rospy.Subscriber(TOPIC, String, heard, queue_size=1000)
    while not over:
        time.sleep(0.01)
    print(*found[-times:])


def relay() -> None:
    """Let through what keeps a rule, of three states, until the end comes."""
    rospy.init_node("llfsm_relay", disable_signals=True)
    publisher = rospy.Publisher(TOPIC, String, queue_size=1000)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    table = {(0, False): 1, (0, True): 0, (1, False): 2, (1, True): 0, (2, False): 2, (2, True): 0}
    state = 0

    def heard(message: String) -> None:
        nonlocal state
        state = table[state, message.data == "stop"]
        publisher.publish(message.data)

    rospy.Subscriber(WATCHED, String, heard, queue_size=1000)
    while True:
        time.sleep(1)


if __name__ == "__main__":
    what, number = sys.argv[1], int(sys.argv[2])
    if what == "listen":
        listen(number)
    elif what == "relay":
        relay()
    else:
        publish(number, 0.0 if what == "publish" else PAUSE, relayed=what == "relayed")

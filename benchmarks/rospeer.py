"""rospy's side of `benchmarks.running`; runs in the system's Python, which has rospy, and imports nothing of ours.

`python3 rospeer.py publish TIMES`: prints seconds of one `publish` with a subscriber in another process, which it
starts; `python3 rospeer.py latency TIMES`: prints, for each message, nanoseconds from before `publish` to the
subscriber's call-back; `python3 rospeer.py relayed TIMES`: the same where a node between the two looks at each message,
as the monitors of ROSRV do, and sends it on. For `benchmarks.rosport`, `there-and-back TIMES` prints the seconds that
it takes, and for each number that it publishes to /llfsm_in, nanoseconds until it hears it from /llfsm_out; `copy 0`
publishes there what it hears. A master must run at ROS_MASTER_URI.
"""

import subprocess
import sys
import threading
import time

import rospy
from std_msgs.msg import Int64, String

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


def there_and_back(times: int) -> None:
    """Each number is sent when the one before is back, at the earliest 20 ms later."""
    rospy.init_node("llfsm_clock", disable_signals=True)
    publisher = rospy.Publisher("/llfsm_in", Int64, queue_size=10)
    back, heard, found = threading.Event(), 0, []

    def hear(message: Int64) -> None:
        nonlocal heard
        now = time.monotonic_ns()
        if message.data == sent:
            heard = now
            back.set()

    sent = 0
    rospy.Subscriber("/llfsm_out", Int64, hear, queue_size=10, tcp_nodelay=True)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    for sent in range(1, times + 11):
        back.clear()
        before = time.monotonic_ns()
        publisher.publish(sent)
        while not back.wait(1.0):  # the way back was not open yet
            before = time.monotonic_ns()
            publisher.publish(sent)
        found.append(heard - before)
        if sent == 10:
            print("begin", flush=True)
            begin = time.monotonic()
        time.sleep(max(0.0, 0.02 - (heard - before) / 1e9 + 0.003 * (sent % 7) / 7))
    print(time.monotonic() - begin, *found[10:])


def copy() -> None:
    rospy.init_node("llfsm_copy", disable_signals=True)
    publisher = rospy.Publisher("/llfsm_out", Int64, queue_size=10)
    rospy.Subscriber(
        "/llfsm_in", Int64, lambda message: publisher.publish(message.data), queue_size=10, tcp_nodelay=True
    )
    while True:
        time.sleep(1)


if __name__ == "__main__":
    what, number = sys.argv[1], int(sys.argv[2])
    if what == "listen":
        listen(number)
    elif what == "relay":
        relay()
    elif what == "copy":
        copy()
    elif what == "there-and-back":
        there_and_back(number)
    else:
        publish(number, 0.0 if what == "publish" else PAUSE, relayed=what == "relayed")

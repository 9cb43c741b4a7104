"""A node of ROS beside the port: it does what lines of JSON on standard input say, and prints what it hears.

It runs under the system's Python and has nothing of ours but the reader of message files.
"""

import json
import os
import random
import sys
import threading
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2] / "llfsm_verify" / "extensions" / "ros"))
out = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

import actionlib  # noqa: E402
import genpy  # noqa: E402
import rospy  # noqa: E402
from genpy.message import fill_message_args  # noqa: E402
from ros1_node.messages import Types  # noqa: E402

types = Types([str(HERE / "msgs")])
kept = {}
lock = threading.Lock()


def tell(**what):
    with lock:
        print(json.dumps(what, default=str), file=out, flush=True)


def plain(message):
    """A message as values of Python."""
    if isinstance(message, genpy.Message):
        return {name: plain(getattr(message, name)) for name in message.__slots__}
    if isinstance(message, genpy.TVal):
        return [message.secs, message.nsecs]
    if isinstance(message, bytes):
        return list(message)
    return [plain(one) for one in message] if isinstance(message, (list, tuple)) else message


def filled(made, values):
    fill_message_args(made, [values] if isinstance(values, dict) else values)
    return made


def publisher(topic, of, latch=False):
    made = types.message(of)
    kept[topic] = rospy.Publisher(topic, made, queue_size=10_000, latch=latch)
    kept[topic, "type"] = made


def publish(topic, values, wait=1):
    while kept[topic].get_num_connections() < wait:
        rospy.rostime.wallsleep(0.005)
    for one in values if isinstance(values, list) else [values]:
        kept[topic].publish(filled(kept[topic, "type"](), one))


def subscriber(topic, of):
    def heard(message):
        tell(topic=topic, values=plain(message))

    kept[topic] = rospy.Subscriber(topic, types.message(of), heard, queue_size=10_000, tcp_nodelay=True)


def unregister(topic):
    kept.pop(topic).unregister()


def service(name, of, answers, hang=False):
    """Answer one request after the other; null: raise."""
    made = types.service(of)
    left = list(answers)

    def serve(request):
        tell(service=name, request=plain(request))
        if hang:
            threading.Event().wait(60)
        answer = left.pop(0)
        if answer is None:
            raise ValueError("no fruit is seen")
        return filled(made._response_class(), answer)

    kept[name] = rospy.Service(name, made, serve)


def call(name, of, values):
    made = types.service(of)
    rospy.wait_for_service(name)

    def act():
        try:
            tell(called=name, response=plain(rospy.ServiceProxy(name, made)(filled(made._request_class(), values))))
        except rospy.ServiceException as error:
            tell(called=name, failed=str(error))

    threading.Thread(target=act, daemon=True).start()


def action(name, of):
    made = types.action(of)

    def goal(handle):
        kept[name, "goal"] = handle
        tell(action=name, goal=plain(handle.get_goal()))

    def cancel(handle):
        tell(action=name, cancelled=True)
        kept[name, "cancelled"] = handle

    server = actionlib.ActionServer(name, made, goal, cancel, auto_start=False)
    server.start()
    kept[name] = server
    kept[name, "action"] = made()


def act(name, act, values=None):
    """Do something with the last goal, such as `set_accepted`."""
    handle = kept[name, "goal"]
    if act == "feedback":
        handle.publish_feedback(filled(type(kept[name, "action"].action_feedback.feedback)(), values))
    elif values is None:
        getattr(handle, act)()
    else:
        getattr(handle, act)(filled(type(kept[name, "action"].action_result.result)(), values))


def whims(service, service_of, action, action_of):
    """Servers that do whatever servers may, and somebody who halts what is under way."""
    draw = random.Random(3)
    made = types.service(service_of)

    def serve(_):
        rospy.rostime.wallsleep(draw.choice([0, 0, 0.02, 0.05, 0.5]))
        if draw.random() < 0.3:
            raise ValueError("not today")
        return made._response_class()

    def live(handle):
        def pause():
            return handle.cancelled.wait(draw.choice([0, 0, 0, 0.01, 0.03, 0.5]))

        if pause() and draw.random() < 0.5:
            handle.set_canceled()
        elif draw.random() < 0.2:
            handle.set_rejected()
        else:
            handle.set_accepted()
            for _ in range(draw.randrange(3)):
                handle.publish_feedback(types.action(action_of)().action_feedback.feedback)
                pause()
            if handle.cancelled.is_set() and draw.random() < 0.7:
                handle.set_canceled()
            elif draw.random() < 0.3:
                handle.set_aborted()
            else:
                handle.set_succeeded()

    by_id = {}

    def goal(handle):
        handle.cancelled = by_id.setdefault(handle.get_goal_id().id, threading.Event())
        threading.Thread(target=live, args=(handle,), daemon=True).start()

    def cancel(handle):
        by_id.setdefault(handle.get_goal_id().id, threading.Event()).set()

    def halt():
        while True:
            kept["/halt"].publish(draw.random() < 0.3)
            rospy.rostime.wallsleep(draw.choice([0.01, 0.03, 0.1]))

    kept[service] = rospy.Service(service, made, serve)
    kept[action] = actionlib.ActionServer(action, types.action(action_of), goal, cancel, auto_start=False)
    kept[action].start()
    threading.Thread(target=halt, daemon=True).start()


def parameter(name, value):
    rospy.set_param(name, value)


def connections(topic):
    tell(connections=kept[topic].get_num_connections())


rospy.init_node("peer", anonymous=True, disable_signals=True)
tell(ready=True)
for line in sys.stdin:
    said = json.loads(line)
    globals()[said.pop("do")](**said)
    tell(done=True)
os._exit(0)

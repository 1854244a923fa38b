"""Messages wait in order; a flood on one topic takes nothing from another."""

import threading

from ab_sim.nodes.inbox import Inbox


def test_a_flood_on_one_topic_takes_nothing_from_another() -> None:
    inbox = Inbox(["block", "command"], length=10)
    for block in range(5):
        inbox.put("block", block)
        for command in range(1000):
            inbox.put("command", command)
    assert len(inbox) == 15
    taken = inbox.take()
    assert [message for topic, message in taken if topic == "block"] == [0, 1, 2, 3, 4]
    assert [message for topic, message in taken if topic == "command"] == list(range(990, 1000))
    assert inbox.dropped == {"block": 0, "command": 4990}
    assert len(inbox) == 0 and inbox.take() == []


def test_messages_keep_their_order_across_topics() -> None:
    inbox = Inbox(["a", "b"], length=10)
    sent = [("b", {"last": 9}), ("a", 5), ("a", 2), ("b", None)]
    for topic, message in sent:
        inbox.put(topic, message)
    assert inbox.take() == sent


def test_what_is_put_while_another_thread_takes_is_taken_or_counted() -> None:
    inbox, sent, taken = Inbox(["a"], length=3), 20_000, 0

    def send() -> None:
        for number in range(sent):
            inbox.put("a", number)

    sender = threading.Thread(target=send)
    sender.start()
    while sender.is_alive():
        taken += len(inbox.take())
    assert taken + len(inbox.take()) + inbox.dropped["a"] == sent

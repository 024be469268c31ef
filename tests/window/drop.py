#!/usr/bin/env python3
"""Drops files on a window of X11, as a file manager does (XDND, version 5).

    drop.py TITLE FILE...

It waits until the window has taken them, and fails when it does not. It needs python-xlib.
"""
import sys
import time
from pathlib import Path

from Xlib import X, display
from Xlib.protocol import event


def find(window, title):
    """Topmost descendant of a window whose title begins with `title`."""
    name = window.get_wm_name()
    if isinstance(name, (str, bytes)) and str(name).startswith(title):
        return window
    for child in window.query_tree().children:
        found = find(child, title)
        if found:
            return found
    return None


def main():
    title, files = sys.argv[1], sys.argv[2:]
    connection = display.Display()
    root = connection.screen().root
    target = find(root, title)
    if target is None:
        sys.exit(f"expected a window named {title}, found none")
    atom = connection.intern_atom
    source = root.create_window(0, 0, 1, 1, 0, connection.screen().root_depth)
    source.set_selection_owner(atom("XdndSelection"), X.CurrentTime)

    def send(kind, *data):
        message = event.ClientMessage(
            window=target, client_type=atom(kind), data=(32, [source.id, *data])
        )
        target.send_event(message, event_mask=X.NoEventMask)

    place = target.get_geometry()
    root_origin = target.translate_coords(root, 0, 0)
    x, y = place.width // 2 - root_origin.x, place.height // 2 - root_origin.y
    version = 5 << 24
    send("XdndEnter", version, atom("text/uri-list"), 0, 0)
    send("XdndPosition", 0, x << 16 | y, X.CurrentTime, atom("XdndActionCopy"))
    connection.flush()
    uris = "".join(f"{Path(file).resolve().as_uri()}\r\n" for file in files).encode()
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        if not connection.pending_events():
            time.sleep(0.02)
            continue
        now = connection.next_event()
        if now.type == X.SelectionRequest:
            now.requestor.change_property(now.property, now.target, 8, uris)
            answer = event.SelectionNotify(
                time=now.time,
                requestor=now.requestor,
                selection=now.selection,
                target=now.target,
                property=now.property,
            )
            now.requestor.send_event(answer)
            connection.flush()
        elif now.type == X.ClientMessage and now.client_type == atom("XdndStatus"):
            if not now.data[1][1] & 1:
                sys.exit("expected a window that takes files, found one that does not")
            send("XdndDrop", 0, X.CurrentTime, 0, 0)
            connection.flush()
        elif now.type == X.ClientMessage and now.client_type == atom("XdndFinished"):
            return
    sys.exit("expected the end of the drop within 10 s, found none")


if __name__ == "__main__":
    main()

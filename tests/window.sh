#!/usr/bin/env bash
# Drives the window of `unic play` as a user does: a figure 8 by the mouse, other keys, sizes down to
# nothing, a screenshot, the end.
#
#   tests/window.sh PROGRAM FOLDER
#
# It needs Xvfb, xdotool and a graphics driver; FOLDER gets the screenshots.
set -euo pipefail

program=$(realpath "$1")
mkdir -p "$2"
cd "$2"
rm -f unic_play_*.png
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-$PWD}
display=:$((90 + RANDOM % 900))
Xvfb "$display" -screen 0 1000x640x24 > xvfb.log 2>&1 &
server=$!
trap 'kill $server 2> /dev/null || true' EXIT
export DISPLAY=$display
for _ in $(seq 50); do xdotool getdisplaygeometry > /dev/null 2>&1 && break; sleep 0.2; done

"$program" play > play.log 2>&1 &
play=$!
for _ in $(seq 150); do window=$(xdotool search --name 'unic play' 2> /dev/null | tail -1) && break; sleep 0.4; done
[[ -n ${window:-} ]] || { echo "no window: $(cat play.log)"; exit 1; }
xdotool windowsize "$window" 960 600
sleep 3
# A display without a window manager gives keys to nobody.
xdotool windowfocus --sync "$window"

# A figure 8 around the middle of the window, with the left button held.
xdotool mousemove 480 330 mousedown 1
for i in $(seq 0 64); do
    read -r x y < <(awk -v i="$i" 'BEGIN { t = i * 6.28318 / 32; print int(480 + 260 * sin(t / 2)), int(360 + 110 * sin(t)) }')
    xdotool mousemove "$x" "$y"
    sleep 0.12
done
xdotool key p
sleep 1
# Both buttons: the character turns to the pointer too.
xdotool mousedown 3 mousemove 700 420
sleep 1
xdotool mouseup 3 mouseup 1
for key in g f b c x x x v t t r k p; do xdotool key "$key"; sleep 0.7; done
xdotool keydown w; sleep 2; xdotool keyup w
for size in '200 100' '1 1' '1000 640' '960 600'; do
    # shellcheck disable=SC2086
    xdotool windowsize "$window" $size
    sleep 0.5
done
xdotool key p
sleep 1
kill -0 $play || { echo "the window has closed itself: $(cat play.log)"; exit 1; }
xdotool key Escape
for _ in $(seq 50); do kill -0 $play 2> /dev/null || break; sleep 0.2; done
wait $play || { echo "exit code $?: $(cat play.log)"; exit 1; }
[[ $(ls unic_play_*.png | wc -l) == 3 ]] || { echo "expected 3 screenshots, found $(ls unic_play_*.png)"; exit 1; }
echo "the window was driven: $(ls unic_play_*.png | tr '\n' ' ')"

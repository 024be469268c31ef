#!/usr/bin/env bash
# Drives the windows of `unic play` and `unic view` as a user does.
#
#   tests/window.sh PROGRAM FOLDER
#
# FOLDER gets the screenshots. It needs Xvfb, xdotool and a graphics driver. Files are dropped where
# python3 has python-xlib, pictures are compared where it has Pillow, and a device is lost where
# libvulkan-dev is installed.
set -euo pipefail

program=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
garments=$here/../apps/unic-cli/garments
mkdir -p "$2"
cd "$2"
rm -rf unic_*.png unic_*.gif capture
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-$PWD}
export DISPLAY=:$((90 + RANDOM % 900))
Xvfb "$DISPLAY" -screen 0 1000x640x24 > xvfb.log 2>&1 &
server=$!
trap 'kill $server ${pid:-} 2> /dev/null || true' EXIT
for _ in $(seq 50); do xdotool getdisplaygeometry > /dev/null 2>&1 && break; sleep 0.2; done

fail() { echo "$*: $(cat window.log)"; exit 1; }

# open NAME ARGUMENT...: starts the program and waits for its window.
open() {
    local name=$1
    shift
    "$program" "$@" > window.log 2>&1 &
    pid=$!
    window=
    for _ in $(seq 150); do window=$(xdotool search --name "$name" 2> /dev/null | tail -1) && break; sleep 0.4; done
    [[ -n ${window:-} ]] || fail "no window"
    xdotool windowsize "$window" 960 600
    sleep 3
    # A display without a window manager gives keys to nobody.
    xdotool windowfocus --sync "$window"
}

keys() { for key in "$@"; do xdotool key "$key"; sleep 0.7; done; }

sizes() {
    for size in '200 100' '1 1' '1000 640' '960 600'; do
        # shellcheck disable=SC2086
        xdotool windowsize "$window" $size
        sleep 0.5
    done
}

lives() { kill -0 $pid 2> /dev/null || fail "the window has closed itself"; }

# ends CODE: the program ends within 10 s and returns CODE.
ends() {
    for _ in $(seq 50); do kill -0 $pid 2> /dev/null || break; sleep 0.2; done
    kill -9 $pid 2> /dev/null && fail "the program has not ended"
    local code=0
    wait $pid || code=$?
    [[ $code == "$1" ]] || fail "expected exit code $1, found $code"
}

# pictures COUNT NAME: so many screenshots whose names begin with NAME are there within a minute.
pictures() {
    for _ in $(seq 300); do
        found=$(find . -name "$2_*.png" | wc -l)
        [[ $found == "$1" ]] && return
        sleep 0.2
    done
    fail "expected $1 screenshots, found $found"
}

# differ NAME A B PERCENT: at least so many of the pixels of two screenshots differ.
differ() {
    if python3 -c 'import PIL' 2> /dev/null; then
        python3 "$here/window/differ.py" "$1_000$2.png" "$1_000$3.png" "$4" || fail "$1, pictures $2 and $3"
    else
        echo "skipped: pictures $2 and $3 of $1 are not compared, for Pillow is not installed"
    fi
}

# A display without a graphics adapter: one sentence, and movies by the rasteriser.
without_adapter() { VK_DRIVER_FILES=/dev/null VK_ICD_FILENAMES=/dev/null WGPU_BACKEND=vulkan "$program" "$@" > window.log 2>&1; }
code=0
without_adapter play || code=$?
[[ $code == 2 ]] && grep -q 'expected a graphics adapter' window.log || fail "without an adapter: exit code $code"
without_adapter play --record pictures --seconds 0.1 --size 160x90 --overwrite || fail "no movie without an adapter"
grep -qi 'rasteriser' window.log || fail "not by the rasteriser"

open 'unic play' play
# A figure 8 around the middle of the window, with the left button held.
xdotool mousemove 480 330 mousedown 1
for i in $(seq 0 64); do
    read -r x y < <(awk -v i="$i" 'BEGIN { t = i * 6.28318 / 32; print int(480 + 260 * sin(t / 2)), int(360 + 110 * sin(t)) }')
    xdotool mousemove "$x" "$y"
    sleep 0.12
done
keys p
# Both buttons: the character turns to the pointer too.
xdotool mousedown 3 mousemove 700 420
sleep 1
xdotool mouseup 3 mouseup 1
# Time stands still, so that pictures differ by the garment alone.
keys space p g p space
keys f b c x x x v t t r k p
xdotool keydown w; sleep 2; xdotool keyup w
sizes
keys p
lives
pictures 5 unic_play
differ unic_play 2 3 1
keys Escape
ends 0

"$program" simulate --garment tshirt --motion walk_circles --test walk_circles --seconds 2 --out capture > window.log 2>&1
open 'unic view' view capture "$garments/tshirt.unic"
keys p e x X w n i k Home Right shift+Right space h h o o f 1 0 m
sleep 2
keys m
xdotool mousemove 300 300 mousedown 1 mousemove_relative 80 10 mouseup 1 click 4 click 5
keys e p
[[ $(head -c 4 unic_view_0001.gif) == GIF8 ]] || fail "no movie"
sizes
lives
if python3 -c 'import Xlib' 2> /dev/null; then
    cp "$here/window.sh" no_model.unic
    python3 "$here/window/drop.py" 'unic view' no_model.unic missing.unic
    sleep 2
    lives
    # One frame, so that pictures differ by what is shown alone.
    keys space Home p
    pictures 3 unic_view
    python3 "$here/window/drop.py" 'unic view' "$garments/skirt.unic"
    for picture in 4 5 6 7 8; do
        sleep 4
        keys p
        pictures $picture unic_view
        (differ unic_view 3 $picture 5) > /dev/null && break
    done
    differ unic_view 3 $picture 5
else
    echo "skipped: dropped files, for python-xlib is not installed"
fi
lives
keys Escape
ends 0

if [[ -e /usr/include/vulkan/vk_layer.h ]]; then
    cc -shared -fPIC -o liblost_device.so "$here/window/lost_device.c"
    cp "$here/window/lost_device.json" .
    rm -f lost
    export LOST_DEVICE_FILE=$PWD/lost VK_ADD_LAYER_PATH=$PWD VK_INSTANCE_LAYERS=VK_LAYER_UNIC_lost_device
    open 'unic play' play
    lives
    touch lost
    ends 1
    grep -q 'internal error' window.log && fail 'a panic'
    cat window.log
else
    echo "skipped: a lost device, for libvulkan-dev is not installed"
fi
echo "the windows were driven: $(ls unic_*.png | tr '\n' ' ')"

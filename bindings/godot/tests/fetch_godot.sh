#!/usr/bin/env bash
# Unpacks Debian's Godot 4 and all its libraries, from the suite sid, into a folder, and prints the path
# of the program: tests/fetch_godot.sh FOLDER
#
# Nothing is installed on the machine. The packages come from where apt has Debian's from.
set -euo pipefail
mkdir -p "$1"
folder=$(realpath "$1")
program=$folder/godot
if [ -x "$program" ] && "$program" --version > /dev/null 2>&1; then
    echo "$program"
    exit
fi

site=$(apt-get indextargets --format '$(SITE)' 'Label: Debian' | sort -u | sed -n 1p)
if [ -z "$site" ]; then
    echo "apt has no packages of Debian" >&2
    exit 1
fi
mkdir -p "$folder/lists/partial" "$folder/cache/archives/partial"
# No package counts as installed, so that those of the C library come too.
: > "$folder/status"
echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $site sid main" > "$folder/sources.list"
cat > "$folder/apt.conf" <<END
Dir::Etc::sourcelist "$folder/sources.list";
Dir::Etc::sourceparts "/dev/null";
Dir::State::lists "$folder/lists";
Dir::Cache "$folder/cache";
Dir::State::status "$folder/status";
END
export APT_CONFIG=$folder/apt.conf
apt-get update -qq >&2
apt-get install -y -qq --no-install-recommends --download-only godot libgl1 libgl1-mesa-dri libglx-mesa0 > /dev/null
for package in "$folder"/cache/archives/*.deb; do
    dpkg-deb --extract "$package" "$folder/files"
done
rm -r "$folder/cache"

libraries=$(dirname "$(find "$folder/files/usr/lib" -name 'libc.so.6')")
loader=$(find "$libraries" -name 'ld-linux*.so.*')
cat > "$program" <<END
#!/bin/sh
export LIBGL_DRIVERS_PATH=$libraries/dri
exec $loader --library-path $libraries:$libraries/pulseaudio $folder/files/usr/bin/godot "\$@"
END
chmod +x "$program"
"$program" --version >&2
echo "$program"

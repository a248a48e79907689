#!/bin/sh
# Writes swarmcert.1.gz and swarmcert-COMMAND.1.gz to FOLDER: what --help prints, converted by help2man.
# Usage: manual_pages.sh TOOL VERSION RELEASE_DATE FOLDER
set -eu
tool=$1 version=$2 date=$3 folder=$4
PATH=$(cd "$(dirname "$tool")" && pwd):$PATH
SOURCE_DATE_EPOCH=$(date --utc --date "$date" +%s)  # in place of today: two builds give the same bytes
export PATH SOURCE_DATE_EPOCH LC_ALL=C.UTF-8

rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
list=$(swarmcert --help | sed -n '/^Start with:/,/^Exit codes/s/^  \([a-z-]*\)  *\(.*\)/\1 \2/p')

# page NAME COMMAND SUMMARY SEE_ALSO
page() {
  printf '[NAME]\n%s \\- %s\n\n[SEE ALSO]\n%s\n' "$1" "$3" "$4" >include
  help2man --no-info --version-string "$version" --include include --output "$1.1" "$2"
  gzip -9n "$1.1"
}

see_also=
while read -r command summary; do
  page "swarmcert-$command" "swarmcert $command" "$summary" '.BR swarmcert (1)'
  see_also="$see_also${see_also:+,
}.BR swarmcert-$command (1)"
done <<LIST
$list
LIST
page swarmcert swarmcert 'formal verification and analysis for learned multirotor controllers' "$see_also"
rm include

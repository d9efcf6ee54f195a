#!/usr/bin/env bash
# Remakes the gallery: solid textures in the project's shapes, and in the real bodies of a mesh folder when there is
# one (POLESTAR_MESHES, or ../shared/meshes beside the checkout), and the counterparts of the paper's figures.
# Usage: apps/gallery.sh [-o FOLDER] [--docs]      default: ./out/gallery; --docs puts the sheets into docs/
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

usage() { sed -n 's/^# \{0,1\}//; 2,4p' "${BASH_SOURCE[0]}"; }

folder=out/gallery
docs=
while [[ $# -gt 0 ]]; do
  case $1 in
    -h | --help)
      usage
      exit 0
      ;;
    -o)
      folder=${2:?"gallery: -o needs a folder"}
      shift 2
      ;;
    --docs)
      docs=yes
      shift
      ;;
    *)
      usage >&2
      exit 2
      ;;
  esac
done

textures=(kiwi watermelon orange tree-rings soccer)
shapes=(head asteroid smooth_star twelve_lobes star_polyhedron cube)
bodies=(bennu phobos castalia max_smooth100 cat_head_capped)
meshes=${POLESTAR_MESHES:-$root/../shared/meshes}
size=960x720
samples=${POLESTAR_GALLERY_SAMPLES:-16}

bash "$root/apps/setup.sh" polestar_tool
polestar=$root/build/release/polestar
mkdir -p -- "$folder/maps"

mesh_of() {
  local candidate
  for candidate in "$root/volumes/$1".* "$meshes/$1".*; do
    [[ $candidate == *.vdb || ! -r $candidate ]] || { printf '%s\n' "$candidate"; return; }
  done
}

# How a shape is seen: a corner is taken out, so that three sections show.
view_of() {
  case $1 in
    head) printf '%s\n' --view=-0.55,0.8,-0.35 --cut 1,0,0,0 --cut 0,-0.15,1,0 --cut 0,-1,0,-0.4 ;;
    max_smooth100 | cat_head_capped) printf '%s\n' --up 0,1,0 --view=-0.55,-0.35,-0.75 --cut x --cut y --cut z ;;
    *) printf '%s\n' --view=-0.5,0.7,-0.5 --cut x --cut -y --cut z ;;
  esac
}

map_shape() {
  local map=$folder/maps/$1.pmap
  [[ -s $map && $map -nt $polestar ]] ||
    "$polestar" map "$(mesh_of "$1")" -o "${map%.pmap}.vdb" --dim 64 --boundary balanced --overwrite -q >/dev/null
}

map_domain() { # SHAPE OPTION...
  local shape=$1 map=$folder/maps/$1-polycube.pmap
  shift
  [[ -s $map && $map -nt $polestar ]] ||
    "$polestar" map "$(mesh_of "$shape")" -o "${map%.pmap}.vdb" --domain polycube "$@" --overwrite -q >/dev/null
}

draw() { # INPUT PICTURE OPTION...
  local input=$1 picture=$2
  shift 2
  [[ -s $picture && $picture -nt $input && $picture -nt $polestar ]] ||
    "$polestar" render "$input" -o "$picture" --size "$size" --samples "$samples" --overwrite -q "$@" >/dev/null
}

# Pictures of one sheet, by rows of `columns`.
sheet() { # FILE TILE COLUMNS PICTURE...
  local file=$1 tile=$2 columns=$3
  shift 3
  local rows=$((($# + columns - 1) / columns)) args=() picture
  for picture in "$@"; do args+=("$picture" --resize "$tile"); done
  oiiotool "${args[@]}" --mosaic:pad=6 "${columns}x$rows" --compression jpeg:88 -o "$file"
  printf 'sheet: %s\n' "$file"
}

gallery() { # FILE SHAPE...
  local file=$1 texture shape view pictures=()
  shift
  for texture in "${textures[@]}"; do
    for shape in "$@"; do
      mapfile -t view < <(view_of "$shape")
      pictures+=("$folder/$texture-$shape.png")
      draw "$folder/maps/$shape.pmap" "${pictures[-1]}" --texture "$texture" "${view[@]}"
      printf '%s in %s\n' "$texture" "$shape"
    done
  done
  sheet "$file" 320x240 $# "${pictures[@]}"
}

figures() {
  # Figure 1: isopotentials, and surfaces made of field lines, on a cut.
  draw "$folder/maps/head.pmap" "$folder/figure-1a.png" --texture coordinates --cut x --view=-0.9,0.4,-0.2
  draw "$folder/maps/smooth_star.pmap" "$folder/figure-1b.png" --texture coordinates --cut x --view=-0.9,0.3,-0.3
  draw "$folder/maps/star_polyhedron.pmap" "$folder/figure-1c.png" --texture coordinates --cut x --view=-0.9,0.3,-0.3
  sheet "$folder/field.jpg" 640x480 3 "$folder"/figure-1{a,b,c}.png

  # Figure 2: the head and the ball, skin, coordinates and a texture.
  "$polestar" map "$root/volumes/ball_offcenter.ply" --center 0.5,0,0 -o "$folder/maps/ball.vdb" --dim 32 --overwrite -q >/dev/null
  local view
  mapfile -t view < <(view_of head)
  draw "$folder/maps/head.pmap" "$folder/figure-2a.png" --texture soccer --cut none --view=-0.55,0.8,-0.35
  draw "$folder/maps/head.pmap" "$folder/figure-2b.png" --texture coordinates "${view[@]}"
  draw "$folder/maps/head.pmap" "$folder/figure-2c.png" --texture kiwi "${view[@]}"
  draw "$folder/maps/ball.pmap" "$folder/figure-2d.png" --texture soccer --cut none --view=-0.55,0.8,-0.35
  draw "$folder/maps/ball.pmap" "$folder/figure-2e.png" --texture coordinates --view=-0.55,0.8,-0.35 --cut x --cut -y --cut z
  draw "$folder/maps/ball.pmap" "$folder/figure-2f.png" --texture kiwi --view=-0.55,0.8,-0.35 --cut x --cut -y --cut z
  sheet "$folder/pipeline.jpg" 640x480 3 "$folder"/figure-2{a,b,c,d,e,f}.png

  # Figure 3: the way from the head by the ball into a polycube. Figure 4: the pig in its polycube.
  map_domain head --cells 5 --domain-axes 0,0,0 --dim 64
  map_domain pig --cells 8 --dim 128
  size=400x480 draw "$folder/maps/head-polycube.pmap" "$folder/figure-3.png" --view=-0.78,0.55,-0.33 \
    --show whole-solid,solid,whole-ball,ball,whole-domain,domain
  size=640x480 draw "$folder/maps/pig-polycube.pmap" "$folder/figure-4.png" --view=-0.9,0.35,-0.3 \
    --show whole-solid,solid,whole-domain,domain
  sheet "$folder/polycube-way.jpg" 1920x384 1 "$folder/figure-3.png"
  sheet "$folder/polycube.jpg" 1920x360 1 "$folder/figure-4.png"

  # Figure 6: the pig turns into the head, and what is inside goes along.
  local row
  for row in soccer watermelon; do
    "$polestar" morph "$root/volumes/pig.ply" "$root/volumes/head.ply" --frames 1-5 --dim 224 --texture "$row" \
      -o "$folder/figure-6-$row-####.vdb" --half --overwrite -q >/dev/null
    view=(--cut none)
    [[ $row == soccer ]] || view=(--cut 1,0,0,0)
    "$polestar" render "$folder/figure-6-$row-####.vdb" -o "$folder/figure-6-$row-####.png" --frames 1-5 --size 400x420 \
      --samples "$samples" --view=-0.9,0.35,-0.3 --overwrite -q "${view[@]}" >/dev/null
  done
  sheet "$folder/morph.jpg" 384x403 5 "$folder"/figure-6-soccer-000{1,2,3,4,5}.png "$folder"/figure-6-watermelon-000{1,2,3,4,5}.png

  # Figure 7: a texture that was made in one body, a .vdb, goes into others.
  local texture=$folder/kiwi-in-fruit.vdb shape
  map_shape fruit
  [[ -s $texture && $texture -nt $polestar ]] ||
    "$polestar" transfer kiwi "$folder/maps/fruit.pmap" -o "$texture" --dim 320 --half --overwrite -q >/dev/null
  draw "$texture" "$folder/figure-7a.png" --cut x --cut -y --cut z --view=-0.5,0.7,-0.5
  for shape in head smooth_star; do
    "$polestar" transfer "$texture" "$folder/maps/$shape.pmap" --source "$folder/maps/fruit.pmap" \
      -o "$folder/kiwi-in-$shape.vdb" --dim 320 --half --overwrite -q >/dev/null
    mapfile -t view < <(view_of "$shape")
    draw "$folder/kiwi-in-$shape.vdb" "$folder/figure-7-$shape.png" "${view[@]}"
  done
  sheet "$folder/transfer.jpg" 640x480 3 "$folder"/figure-7{a,-head,-smooth_star}.png
}

for shape in "${shapes[@]}"; do map_shape "$shape"; done
gallery "$folder/gallery.jpg" "${shapes[@]}"
figures
sheets=(gallery field pipeline polycube polycube-way morph transfer)
if [[ -r $meshes/bennu.ply ]]; then
  for shape in "${bodies[@]}"; do map_shape "$shape"; done
  gallery "$folder/gallery-bodies.jpg" "${bodies[@]}"
  sheets+=(gallery-bodies)
else
  printf 'no mesh folder: the real bodies are left out\n'
fi
if [[ $docs ]]; then
  for name in "${sheets[@]}"; do cp -- "$folder/$name.jpg" "$root/docs/$name.jpg"; done
fi

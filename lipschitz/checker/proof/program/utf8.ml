(* UTF-8 as RFC 3629 has it. *)

let add buffer code =
  let add c = Buffer.add_char buffer (Char.chr c) in
  let rest shift = add (0x80 lor ((code lsr shift) land 0x3F)) in
  if code < 0x80 then add code
  else if code < 0x800 then (add (0xC0 lor (code lsr 6)); rest 0)
  else if code < 0x10000 then (add (0xE0 lor (code lsr 12)); rest 6; rest 0)
  else (add (0xF0 lor (code lsr 18)); rest 12; rest 6; rest 0)

(* Shortest forms only, no surrogates, nothing above U+10FFFF. *)
let is_valid text =
  let size = String.length text in
  let byte k = Char.code text.[k] in
  let follows at low high = at < size && byte at >= low && byte at <= high in
  let tail at = follows at 0x80 0xBF in
  let rec go at =
    if at >= size then true else
    match byte at with
    | c when c < 0x80 -> go (at + 1)
    | c when c >= 0xC2 && c <= 0xDF -> tail (at + 1) && go (at + 2)
    | c when c >= 0xE0 && c <= 0xEF ->
      let low = if c = 0xE0 then 0xA0 else 0x80 and high = if c = 0xED then 0x9F else 0xBF in
      follows (at + 1) low high && tail (at + 2) && go (at + 3)
    | c when c >= 0xF0 && c <= 0xF4 ->
      let low = if c = 0xF0 then 0x90 else 0x80 and high = if c = 0xF4 then 0x8F else 0xBF in
      follows (at + 1) low high && tail (at + 2) && tail (at + 3) && go (at + 4)
    | _ -> false in
  go 0

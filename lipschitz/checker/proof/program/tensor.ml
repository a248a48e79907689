(* Named tensors, and the numbers that files hold. *)

(* `numbers` are read once the shape is known to be that of a layer. *)
type t = { tensor : string; shape : int list; kind : string; numbers : unit -> float array }

let most_numbers = 1 lsl 26
let is_float kind = List.mem kind [ "float16"; "bfloat16"; "float32"; "float64" ]

(* The exact value of these 16 bits. *)
let of_half kind bits =
  if kind = "bfloat16" then Int32.float_of_bits (Int32.shift_left (Int32.of_int bits) 16)
  else
    let sign = if bits land 0x8000 <> 0 then -1. else 1. in
    let exponent = (bits lsr 10) land 0x1f and fraction = bits land 0x3ff in
    if exponent = 0x1f then if fraction <> 0 then nan else sign *. infinity
    else if exponent = 0 then sign *. Float.ldexp (float_of_int fraction) (-24)
    else sign *. Float.ldexp (float_of_int (1024 + fraction)) (exponent - 25)

let width = function "float16" | "bfloat16" -> 2 | "float32" -> 4 | _ -> 8
(* The k-th little-endian number. *)
let number_at kind data first k = match width kind with
  | 2 -> of_half kind (String.get_uint16_le data (first + 2 * k))
  | 4 -> Int32.float_of_bits (String.get_int32_le data (first + 4 * k))
  | _ -> Int64.float_of_bits (String.get_int64_le data (first + 8 * k))

(* The product of sizes >= 0, or more than `most_numbers` where it is larger. *)
let count shape =
  if List.mem 0 shape then 0
  else List.fold_left (fun product n -> if product > most_numbers / n then most_numbers + 1 else product * n) 1 shape

let starts_with prefix text = String.length text >= String.length prefix &&
    String.sub text 0 (String.length prefix) = prefix
let ends_with suffix text = String.length text >= String.length suffix
  && String.sub text (String.length text - String.length suffix) (String.length suffix) = suffix
let contains part text =
  let n = String.length part in
  let rec go k = k + n <= String.length text && (String.sub text k n = part || go (k + 1)) in
  go 0

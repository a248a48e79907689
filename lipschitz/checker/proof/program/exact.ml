(* Doubles and their notations as exact dyadic numbers (mantissa, exponent) of extracted/proved.ml. *)

open Refusal

let zero = Z.zero, Z.zero
let one = Z.one, Z.zero

(* Of a finite double. *)
let of_float x =
  assert (Float.is_finite x);
  if x = 0. then zero else
  let fraction, exponent = Float.frexp x in
  let mantissa = Z.of_float (Float.ldexp fraction 53) in
  let zeros = Z.trailing_zeros mantissa in
  Z.shift_right mantissa zeros, Z.of_int (exponent - 53 + zeros)

(* Rounded to nearest, ties to even; infinite beyond the range of a double. *)
let nearest (m, e) =
  let size = Z.numbits m in
  let dropped = max (size - 53) (-1074 - e) in
  if dropped <= 0 then Float.ldexp (Z.to_float m) e
  else if dropped > size + 1 then 0.
  else
    let whole = Z.shift_right (Z.abs m) dropped and half = Z.shift_left Z.one (dropped - 1) in
    let beyond = Z.compare (Z.sub (Z.abs m) (Z.shift_left whole dropped)) half in
    let rounded = if beyond > 0 || (beyond = 0 && Z.is_odd whole) then Z.succ whole else whole in
    let size = Float.ldexp (Z.to_float rounded) (e + dropped) in
    if Z.sign m < 0 then -. size else size
(* The same to float32. *)
let float32 x = Int32.float_of_bits (Int32.bits_of_float x)

(* A C99 hex float that a double holds exactly; strictly what the C++ reader takes. *)
let parse_hex_float text =
  let size = String.length text in
  let fail () = rejected "parse_hex_float: \"%s\" is not a finite hex float of a double" (shown text) in
  if size > 5000 then fail ();
  let at = ref 0 in
  let accept characters = if !at < size && String.contains characters text.[!at] then (incr at; true) else false in
  let is_negative = accept "-" in
  if not (accept "0") then fail ();
  if not (accept "xX") then fail ();
  let run allowed =
    let first = !at in
    while !at < size && String.contains allowed text.[!at] do incr at done;
    String.sub text first (!at - first) in
  let hex = "0123456789abcdefABCDEF" in
  let whole = run hex in
  let fraction = if accept "." then run hex else "" in
  if whole ^ fraction = "" then fail ();
  if not (accept "pP") then fail ();
  let is_small = accept "-" in
  if not is_small then ignore (accept "+");
  let power = run "0123456789" in
  if power = "" || !at <> size || String.length power > 6 then fail ();
  let mantissa = Z.of_string_base 16 (whole ^ fraction) in
  if Z.equal mantissa Z.zero then (if is_negative then -0. else 0.) else
  let power = int_of_string ("0u" ^ power) in
  let zeros = Z.trailing_zeros mantissa in
  let mantissa = Z.shift_right mantissa zeros in
  let exponent = (if is_small then - power else power) - 4 * String.length fraction + zeros in
  if Z.numbits mantissa > 53 || exponent < -1074 || exponent + Z.numbits mantissa > 1024 then fail ();
  let value = Float.ldexp (Z.to_float mantissa) exponent in
  if is_negative then -. value else value

let hex_float where json = parse_hex_float (Json.text where json)
let hex_floats where json = List.map (hex_float where) (Json.list where json)

(* `decimal` and `hex` are one number that is not negative. *)
let number where decimal hex =
  let value = hex_float where hex in
  let same = match decimal with Json.Number { value = d; _ } -> d = value | _ -> false in
  require (same && value >= 0.) "%s: negative, or decimal and hex notation differ" where;
  value

let is_space c = c = ' ' || (c >= '\t' && c <= '\r')
let words text =
  let size = String.length text in
  let rec go at found =
    if at >= size then List.rev found
    else if is_space text.[at] then go (at + 1) found
    else begin
      let last = ref at in
      while !last < size && not (is_space text.[!last]) do incr last done;
      go !last (String.sub text at (!last - at) :: found)
    end in
  go 0 []

let integer where word =
  require (String.length word <= 40) "%s: integer too long" where;
  let digits = if word <> "" && word.[0] = '-' then String.sub word 1 (String.length word - 1) else word in
  require (digits <> "" && String.for_all (fun c -> c >= '0' && c <= '9') digits) "%s: not an integer" where;
  Z.of_string word

(* The factor of a matrix inequality: lower rows without their leading zeros. *)
let factor where json =
  Json.require_keys where [ "unit_exponent"; "scale"; "rows" ] json;
  let exponent json =
    let e = Json.whole where json in
    require (abs e <= 8192) "%s: exponent out of range" where; Z.of_int e in
  let unit0 = exponent (Json.find where "unit_exponent" json) in
  let scales = List.map exponent (Json.list where (Json.find where "scale" json)) in
  let rows = List.map (fun row -> List.map (integer where) (words (Json.text where row)))
      (Json.list where (Json.find where "rows" json)) in
  let fits = List.length rows = List.length scales &&
      List.for_all Fun.id (List.mapi (fun i row -> List.length row <= i + 1) rows) in
  require fits "%s: the factor does not show that the matrix inequality holds" (Filename.chop_suffix where ".factor");
  let filled = List.mapi (fun i row -> List.init (i + 1 - List.length row) (fun _ -> Z.zero) @ row) rows in
  { Proved.unit0; scales; rows = filled }

(* Protocol buffers as ONNX uses them: the fields of a message, in order. *)

open Refusal

type value = Number of int64 | Fixed of string | Bytes of string

let varint path data at =
  let rec go value shift =
    if !at >= String.length data || shift > 63 then bad_input "%s: a protobuf number is cut off or too long" path;
    let byte = Char.code data.[!at] in
    incr at;
    if shift = 63 && byte land 0x7E <> 0 then bad_input "%s: a protobuf number is too long" path;
    let value = Int64.logor value (Int64.shift_left (Int64.of_int (byte land 127)) shift) in
    if byte < 128 then value else go value (shift + 7) in
  go 0L 0

(* (number, value) of each field. *)
let fields path data =
  let at = ref 0 in
  let take n =
    if n < 0 || n > String.length data - !at then bad_input "%s: a protobuf field is longer than what holds it" path;
    let part = String.sub data !at n in
    at := !at + n; part in
  let length () =
    let n = varint path data at in
    if Int64.compare n 0L < 0 || Int64.compare n (Int64.of_int max_int) > 0 then -1 else Int64.to_int n in
  let rec go found =
    if !at = String.length data then List.rev found else begin
      let tag = varint path data at in
      let number = Int64.to_int (Int64.shift_right_logical tag 3) in
      if number < 1 || number > 536870911 then bad_input "%s: is not a protobuf field number" path;
      let value = match Int64.to_int (Int64.logand tag 7L) with
        | 0 -> Number (varint path data at)
        | 1 -> Fixed (take 8)
        | 5 -> Fixed (take 4)
        | 2 -> let n = length () in Bytes (take n)
        | _ -> bad_input "%s: is not a protobuf field type that ONNX uses" path in
      go ((number, value) :: found)
    end in
  go []

let bytes path = function Bytes b -> b | _ -> bad_input "%s: a message is stored as a number" path
(* Of a repeated field, whether it came as one number or packed. *)
let integers path = function
  | Number n -> [ n ]
  | Bytes data ->
    let at = ref 0 in
    let rec go found = if !at = String.length data then List.rev found else let n = varint path data at in
        go (n :: found) in
    go []
  | Fixed _ -> bad_input "%s: a number of another type" path

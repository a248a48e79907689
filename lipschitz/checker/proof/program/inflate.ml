(* zlib streams, RFC 1950 and 1951, decompressed up to a limit. *)

exception Damaged
exception Too_long

(* Bits of bytes, the lowest one first. *)
type bits = { data : string; mutable at : int; mutable held : int; mutable count : int }

let byte bits =
  if bits.at >= String.length bits.data then raise Damaged;
  bits.at <- bits.at + 1;
  Char.code bits.data.[bits.at - 1]
let take bits n =
  while bits.count < n do
    bits.held <- bits.held lor (byte bits lsl bits.count);
    bits.count <- bits.count + 8
  done;
  let value = bits.held land (1 lsl n - 1) in
  bits.held <- bits.held lsr n;
  bits.count <- bits.count - n;
  value

(* A Huffman code: how many words there are of each length, and their symbols in ascending order of the words. *)
type code = { words : int array; symbols : int array }

let code_of lengths =
  let words = Array.make 16 0 in
  Array.iter (fun n -> if n > 0 then words.(n) <- words.(n) + 1) lengths;
  ignore (Array.fold_left (fun free n -> if free < n then raise Damaged else 2 * (free - n)) 1 words);
  let of_length n = List.filter (fun symbol -> lengths.(symbol) = n) (List.init (Array.length lengths) Fun.id) in
  { words; symbols = Array.of_list (List.concat_map of_length (List.init 15 (fun n -> n + 1))) }

let symbol bits code =
  let rec go length word first index =
    if length > 15 then raise Damaged;
    let word = word lor take bits 1 and count = code.words.(length) in
    if word - first < count then code.symbols.(index + word - first)
    else go (length + 1) (2 * word) (2 * (first + count)) (index + count) in
  go 1 0 0 0

let lengths = [| 3; 4; 5; 6; 7; 8; 9; 10; 11; 13; 15; 17; 19; 23; 27; 31; 35; 43; 51; 59; 67; 83; 99; 115; 131; 163;
                 195; 227; 258 |]
let bits_of_length k = if k < 8 || k = 28 then 0 else k / 4 - 1
let distances = [| 1; 2; 3; 4; 5; 7; 9; 13; 17; 25; 33; 49; 65; 97; 129; 193; 257; 385; 513; 769; 1025; 1537; 2049;
                   3073; 4097; 6145; 8193; 12289; 16385; 24577 |]
let bits_of_distance k = max 0 (k / 2 - 1)

let fixed_codes () =
  code_of (Array.init 288 (fun k -> if k < 144 then 8 else if k < 256 then 9 else if k < 280 then 7 else 8)),
  code_of (Array.make 30 5)

let stated_codes bits =
  let literals = take bits 5 + 257 in
  let far = take bits 5 + 1 in
  let count = take bits 4 + 4 and found = Array.make 19 0 in
  List.iteri (fun k place -> if k < count then found.(place) <- take bits 3)
    [ 16; 17; 18; 0; 8; 7; 9; 6; 10; 5; 11; 4; 12; 3; 13; 2; 14; 1; 15 ];
  let code = code_of found and stated = Array.make (literals + far) 0 in
  let rec fill at =
    let repeat value n =
      if at + n > Array.length stated then raise Damaged;
      Array.fill stated at n value;
      fill (at + n) in
    if at < Array.length stated then match symbol bits code with
      | 16 -> if at = 0 then raise Damaged else repeat stated.(at - 1) (take bits 2 + 3)
      | 17 -> repeat 0 (take bits 3 + 3)
      | 18 -> repeat 0 (take bits 7 + 11)
      | length -> repeat length 1 in
  fill 0;
  code_of (Array.sub stated 0 literals), code_of (Array.sub stated literals far)

let inflated ~limit data =
  let bits = { data; at = 0; held = 0; count = 0 } and out = Buffer.create 65536 in
  let add c = if Buffer.length out >= limit then raise Too_long else Buffer.add_char out c in
  let header = 256 * byte bits in
  let header = header + byte bits in
  if header mod 31 <> 0 || header land 0xf20 <> 0x800 then raise Damaged;
  let rec block (literal, far) = match symbol bits literal with
    | 256 -> ()
    | k when k < 256 -> add (Char.chr k); block (literal, far)
    | k ->
      let k = k - 257 in
      if k >= Array.length lengths then raise Damaged;
      let length = lengths.(k) + take bits (bits_of_length k) in
      let k = symbol bits far in
      if k >= Array.length distances then raise Damaged;
      let distance = distances.(k) + take bits (bits_of_distance k) in
      if distance > Buffer.length out then raise Damaged;
      for _ = 1 to length do add (Buffer.nth out (Buffer.length out - distance)) done;
      block (literal, far) in
  let stored () =
    bits.held <- 0;
    bits.count <- 0;
    let length = take bits 16 in
    if take bits 16 <> length lxor 0xffff then raise Damaged;
    for _ = 1 to length do add (Char.chr (byte bits)) done in
  let rec blocks () =
    let is_last = take bits 1 = 1 in
    (match take bits 2 with
     | 0 -> stored () | 1 -> block (fixed_codes ()) | 2 -> block (stated_codes bits) | _ -> raise Damaged);
    if not is_last then blocks () in
  blocks ();
  let result = Buffer.contents out in
  let sum a b = (a + b) mod 65521 in
  let low, high = String.fold_left (fun (low, high) c -> let low = sum low (Char.code c) in low, sum high low)
      (1, 0) result in
  let checksum = List.fold_left (fun n _ -> 256 * n + byte bits) 0 [ 1; 2; 3; 4 ] in
  if checksum <> 65536 * high + low then raise Damaged;
  result

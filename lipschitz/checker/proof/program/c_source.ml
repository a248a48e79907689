(* The C source that the authors of networks generate: structs of float and double arrays, and objects of them. *)

open Refusal

type member = { name : string; kind : string; shape : int list; mutable values : float list (* the last one first *) }

(* The exact value of a plain decimal: digits, point, exponent. *)
let rational text =
  let mantissa, exponent = match String.index_opt (String.lowercase_ascii text) 'e' with
    | Some at -> String.sub text 0 at, int_of_string (let e = String.sub text (at + 1) (String.length text - at - 1) in
                                                       if e.[0] = '+' then String.sub e 1 (String.length e - 1) else e)
    | None -> text, 0 in
  let whole, fraction = match String.index_opt mantissa '.' with
    | Some at -> String.sub mantissa 0 at, String.sub mantissa (at + 1) (String.length mantissa - at - 1)
    | None -> mantissa, "" in
  let power = exponent - String.length fraction in
  let digits = Q.of_bigint (Z.of_string ("0" ^ whole ^ fraction)) and ten = Z.pow (Z.of_int 10) (abs power) in
  if power >= 0 then Q.mul digits (Q.of_bigint ten) else Q.div digits (Q.of_bigint ten)

(* A decimal rounded once to float32. By way of double it would be rounded twice, which matters halfway between
   floats. *)
let nearest_float32 text =
  let double = float_of_string text in
  let single = Exact.float32 double in
  if single = double || not (Float.is_finite single) || double < 0x1p-1022 then single else
  let bits = Int32.bits_of_float single in
  let other = Int32.float_of_bits (if single < double then Int32.succ bits else Int32.pred bits) in
  let low = Float.min single other and high = Float.max single other in
  if (low +. high) /. 2. <> double then single
  else match Q.compare (rational text) (Q.of_float double) with
    | 0 -> single | sign -> if sign > 0 then high else low

let is_letter c = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c = '_'
let is_digit c = c >= '0' && c <= '9'

let objects path text =
  let at = ref 0 and size = String.length text in
  let fail what = bad_input "%s: byte %d: %s" path !at what in
  let peek k = if !at + k < size then text.[!at + k] else '\000' in
  let rec skip () = match peek 0, peek 1 with
    | (' ' | '\t' | '\r' | '\n'), _ -> incr at; skip ()
    | '/', '/' | '#', _ -> at := (match String.index_from_opt text !at '\n' with Some stop -> stop | None -> size);
        skip ()
    | '/', '*' ->
      at := !at + 2;
      while !at < size && not (peek 0 = '*' && peek 1 = '/') do incr at done;
      at := min size (!at + 2); skip ()
    | _ -> () in
  let accept c = if !at < size && text.[!at] = c then (incr at; skip (); true) else false in
  let expect c = if not (accept c) then fail (Printf.sprintf "expected '%c'" c) in
  let run allowed =
    let first = !at in
    while !at < size && allowed text.[!at] do incr at done;
    String.sub text first (!at - first) in
  let word () =
    let w = if is_letter (peek 0) then run (fun c -> is_letter c || is_digit c) else "" in
    skip (); w in
  let accept_word expected = let before = !at in if word () = expected then true else (at := before; false) in
  let number kind =
    let negative = peek 0 = '-' in
    if negative then incr at;
    let first = !at in
    if not (is_digit (peek 0) || (peek 0 = '.' && is_digit (peek 1))) then fail "expected a number";
    ignore (run is_digit);
    if peek 0 = '.' then (incr at; ignore (run is_digit));
    let is_exponent = (peek 0 = 'e' || peek 0 = 'E') &&
        (is_digit (peek 1) || ((peek 1 = '+' || peek 1 = '-') && is_digit (peek 2))) in
    if is_exponent then (at := !at + 2; if String.length (run is_digit) > 4 then
        fail "the number is beyond the range of its type");
    let digits = String.sub text first (!at - first) in
    let single = peek 0 = 'f' || peek 0 = 'F' in
    if single then incr at;
    if is_letter (peek 0) || is_digit (peek 0) then fail "expected a decimal number";
    skip ();
    let value = if single then nearest_float32 digits
      else if kind = "float32" then Exact.float32 (float_of_string digits) else float_of_string digits in
    if not (Float.is_finite value) then fail "the number is beyond the range of its type";
    if negative then -. value else value in
  let members () =
    let rec go found =
      if accept '}' then List.rev found else begin
        let kind = if accept_word "double" then "float64" else if accept_word "float" then
            "float32" else fail "a member is neither float nor double" in
        let name = word () in
        let rec sizes () =
          if accept '[' then begin
            let digits = run is_digit in
            if digits = "" || String.length digits > 8 then fail "expected the size of an array";
            skip (); expect ']'; let n = int_of_string ("0u" ^ digits) in n :: sizes ()
          end else [] in
        let shape = sizes () in
        expect ';';
        if shape = [] || List.length shape > 2 || List.mem 0 shape then fail "is neither a matrix nor a vector";
        go ({ name; kind; shape; values = [] } :: found)
      end in
    go [] in
  let rec array member = function
    | [] -> member.values <- number member.kind :: member.values
    | n :: inner ->
      expect '{';
      for k = 1 to n do if k > 1 then expect ','; array member inner done;
      ignore (accept ','); expect '}' in
  let types = Hashtbl.create 8 and found = ref [] in
  let read_object tag =
    let name = word () in
    let fresh member = { member with values = [] } in
    let members = match Hashtbl.find_opt types tag with Some ms -> List.map fresh ms | None ->
        fail "is of an unknown type" in
    expect '='; expect '{';
    let rec fill () =
      if not (accept '}') then begin
        expect '.';
        let field = word () in
        let member = match List.find_opt (fun m -> m.name = field) members with Some m -> m | None ->
            fail "is not a member of its type" in
        if member.values <> [] then fail "is initialised twice";
        expect '='; array member member.shape;
        if accept ',' then fill () else expect '}'
      end in
    fill (); expect ';';
    if List.exists (fun m -> m.values = []) members then fail "a member is not initialised";
    let key = if Tensor.starts_with "weights_" name then String.sub name 8 (String.length name - 8) else name in
    if List.mem_assoc key !found then fail "is defined twice";
    found := (key, members) :: !found in
  skip ();
  while !at < size do
    while accept_word "static" || accept_word "const" do () done;
    if not (accept_word "struct") then fail "expected a struct or an object of one";
    let tag = word () in
    if accept '{' then begin
      let ms = members () in
      expect ';';
      if Hashtbl.mem types tag then fail "is defined twice";
      Hashtbl.add types tag ms
    end else read_object tag
  done;
  !found

let tensor member =
  let named part = let suffix = "_" ^ part in
    if String.length member.name > String.length suffix && Tensor.ends_with suffix member.name
    then Some (String.sub member.name 0 (String.length member.name - String.length suffix) ^ "." ^ part) else None in
  let name = match named "weight", named "bias" with Some n, _ | None, Some n -> n | None, None -> member.name in
  let flat = Array.of_list (List.rev member.values) in
  match member.shape with
  | [ rows; columns ] ->
    let numbers () = Array.init (rows * columns) (fun k -> flat.((k mod rows) * columns + k / rows)) in
    { Tensor.tensor = name; shape = [ columns; rows ]; kind = member.kind; numbers }
  | shape -> { Tensor.tensor = name; shape; kind = member.kind; numbers = (fun () -> flat) }

let read path bytes ~key ~order =
  let found = objects path bytes in
  let members = match found, key with
    | [ (_, members) ], "" -> members
    | [], _ -> bad_input "%s: holds no network" path
    | _, "" -> bad_input "%s: holds several networks: name one with --key, or as FILE#KEY" path
    | _ -> (match List.assoc_opt key found with Some ms -> ms | None ->
        bad_input "%s: \"%s\" is not in this file" path (shown key)) in
  Weights.assemble ~path ~sha256:(Sha256.to_hex (Sha256.string bytes)) Layer_order.Registration ~order
      (List.map tensor members)

(* Whether the text begins as one of these files does. *)
let looks_like bytes =
  let beginning = String.sub bytes 0 (min 4096 (String.length bytes)) in
  not (String.contains beginning '\000')
  && (let rec first at =
        if at >= String.length beginning then "" else
          match beginning.[at] with
          | ' ' | '\t' | '\r' | '\n' -> first (at + 1)
          | '#' -> line at
          | '/' when at + 1 < String.length beginning && beginning.[at + 1] = '/' -> line at
          | '/' when at + 1 < String.length beginning && beginning.[at + 1] = '*' -> comment (at + 2)
          | _ -> String.sub beginning at (min 7 (String.length beginning - at))
      and line at = match String.index_from_opt beginning at '\n' with Some stop -> first stop | None -> ""
      and comment at =
        if at + 1 >= String.length beginning then "" else if beginning.[at] = '*' && beginning.[at + 1] = '/' then
            first (at + 2) else comment (at + 1) in
      let word = first 0 in
      List.exists (fun w -> Tensor.starts_with (w ^ " ") word) [ "struct"; "static"; "const" ])

(* JSON as RFC 8259 has it, and nothing beside: no byte order mark, no key twice, no NaN, nesting up to 64 levels. *)

open Refusal

type t =
  | Null
  | Bool of bool
  | Number of { value : float; is_integer : bool }
  | Text of string
  | Array of t list
  | Object of (string * t) list

let deepest = 64

let parse path text =
  let at = ref 0 and size = String.length text in
  let fail what = bad_input "%s: byte %d: is not JSON (%s)" path !at what in
  if size >= 3 && String.sub text 0 3 = "\xef\xbb\xbf" then fail "begins with a byte order mark";
  if not (Utf8.is_valid text) then fail "not UTF-8";
  let peek () = if !at < size then text.[!at] else '\000' in
  let rec skip () = match peek () with ' ' | '\t' | '\n' | '\r' -> incr at; skip () | _ -> () in
  let expect c = if !at < size && text.[!at] = c then incr at else fail (Printf.sprintf "expected '%c'" c) in
  let word w value =
    let n = String.length w in
    if !at + n <= size && String.sub text !at n = w then (at := !at + n; value) else fail "unknown word" in
  let digits () =
    let first = !at in
    while (match peek () with '0' .. '9' -> true | _ -> false) do incr at done;
    if !at = first then fail "a digit is missing" in
  let number () =
    let first = !at in
    if peek () = '-' then incr at;
    if peek () = '0' then incr at else digits ();
    let is_integer = ref true in
    if peek () = '.' then (is_integer := false; incr at; digits ());
    (match peek () with
     | 'e' | 'E' ->
       is_integer := false; incr at;
       (match peek () with '+' | '-' -> incr at | _ -> ());
       digits ()
     | _ -> ());
    let value = float_of_string (String.sub text first (!at - first)) in
    if not (Float.is_finite value) then fail "a number is out of range";
    Number { value; is_integer = !is_integer && Float.abs value < 0x1p63 } in
  let hex4 () =
    if !at + 4 > size then fail "a \\u escape is cut short";
    let digit c = match c with
      | '0' .. '9' -> Char.code c - 48 | 'a' .. 'f' -> Char.code c - 87 | 'A' .. 'F' -> Char.code c - 55
      | _ -> fail "a \\u escape without four digits" in
    let code = ref 0 in
    for _ = 1 to 4 do code := 16 * !code + digit text.[!at]; incr at done;
    !code in
  let escape buffer = match peek () with
    | ('"' | '\\' | '/') as c -> incr at; Buffer.add_char buffer c
    | 'b' -> incr at; Buffer.add_char buffer '\b'
    | 'f' -> incr at; Buffer.add_char buffer '\012'
    | 'n' -> incr at; Buffer.add_char buffer '\n'
    | 'r' -> incr at; Buffer.add_char buffer '\r'
    | 't' -> incr at; Buffer.add_char buffer '\t'
    | 'u' ->
      incr at;
      let code = hex4 () in
      if code >= 0xDC00 && code < 0xE000 then fail "half of a surrogate pair";
      if code < 0xD800 || code >= 0xE000 then Utf8.add buffer code
      else begin
        expect '\\'; expect 'u';
        let low = hex4 () in
        if low < 0xDC00 || low >= 0xE000 then fail "half of a surrogate pair";
        Utf8.add buffer (0x10000 + ((code - 0xD800) lsl 10) + (low - 0xDC00))
      end
    | _ -> fail "unknown escape" in
  let string () =
    expect '"';
    let buffer = Buffer.create 32 in
    let rec go () =
      if !at >= size then fail "a text does not end";
      match text.[!at] with
      | '"' -> incr at
      | '\\' -> incr at; escape buffer; go ()
      | c when Char.code c < 0x20 -> fail "a control character"
      | c -> incr at; Buffer.add_char buffer c; go () in
    go (); Buffer.contents buffer in
  (* Elements up to `close`, in order. *)
  let listed close element =
    incr at; skip ();
    if peek () = close then (incr at; []) else
    let rec go found =
      let found = element () :: found in
      skip ();
      if peek () = ',' then (incr at; skip (); go found) else (expect close; List.rev found) in
    go [] in
  let rec value depth =
    skip ();
    match peek () with
    | '{' | '[' when depth >= deepest -> fail "nested more than 64 levels deep"
    | '{' ->
      let keys = Hashtbl.create 16 in
      Object (listed '}' (fun () ->
        let key = string () in
        if Hashtbl.mem keys key then fail "a key appears twice";
        if Hashtbl.length keys >= 10_000 then fail "an object has too many keys";
        Hashtbl.add keys key ();
        skip (); expect ':';
        let member = value (depth + 1) in
        key, member))
    | '[' -> Array (listed ']' (fun () -> value (depth + 1)))
    | '"' -> Text (string ())
    | 't' -> word "true" (Bool true)
    | 'f' -> word "false" (Bool false)
    | 'n' -> word "null" Null
    | '-' | '0' .. '9' -> number ()
    | _ -> fail "no value" in
  let result = value 0 in
  skip ();
  if !at <> size then fail "something follows the value";
  result

(* The bytes that content_sha256 hashes: independent of white space and of the order of members. *)
let encode document =
  let out = Buffer.create 65536 in
  let text s = Printf.bprintf out "s%d:%s" (String.length s) s in
  let rec go = function
    | Null -> Buffer.add_char out 'n'
    | Bool b -> Buffer.add_char out (if b then 't' else 'f')
    | Number { value; _ } -> Printf.bprintf out "d%016Lx" (Int64.bits_of_float value)
    | Text s -> text s
    | Array elements -> Buffer.add_char out '['; List.iter go elements; Buffer.add_char out ']'
    | Object members ->
      Buffer.add_char out '{';
      List.iter (fun (key, member) -> text key; go member)
        (List.sort (fun (a, _) (b, _) -> String.compare a b) members);
      Buffer.add_char out '}' in
  go document; Buffer.contents out

let kind = function
  | Null -> "null" | Bool _ -> "boolean" | Number _ -> "number" | Text _ -> "text" | Array _ -> "array"
  | Object _ -> "object"

(* Members and elements; what is missing or of another type rejects the certificate. *)
let members where = function Object members -> members | other ->
    rejected "%s is not an object but %s" where (kind other)
let find where key json =
  match List.assoc_opt key (members where json) with Some member -> member | None ->
      rejected "%s lacks field %s" where key
let has key = function Object members -> List.mem_assoc key members | _ -> false
let text where = function Text s -> s | other -> rejected "%s: expected text, found %s" where (kind other)
let list where = function Array elements -> elements | other -> rejected
    "%s: expected an array, found %s" where (kind other)
let element where k json = match List.nth_opt (list where json) k with Some e -> e | None ->
    rejected "%s: has no element %d" where k

let require_keys where keys json =
  let found = members where json in
  List.iter (fun (key, _) -> require (List.mem key keys) "%s has unknown field %s" where (shown key)) found;
  List.iter (fun key -> require (List.mem_assoc key found) "%s lacks field %s" where key)
      (List.sort String.compare keys)

(* A whole number; a fraction is cut off, as the other checkers do. *)
let whole where = function
  | Number { value; _ } -> require (Float.abs value < 1e15) "%s: a number is out of range" where; int_of_float value
  | other -> rejected "%s: expected a number, found %s" where (kind other)

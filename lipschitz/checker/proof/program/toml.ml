(* The part of TOML that a network.toml needs, as JSON values: tables, dotted keys, inline tables, arrays, texts on one
   line, decimal numbers, true and false. Everything else is refused, and so is a key or a table that appears twice. *)

open Refusal

type node = Leaf of Json.t | Table of table
and table = { entries : (string, node) Hashtbl.t; mutable is_stated : bool }

let empty is_stated = { entries = Hashtbl.create 8; is_stated }
let rec json_of table =
  let member (key, node) = key, (match node with Leaf value -> value | Table inner -> json_of inner) in
  let sorted = List.sort (fun (a, _) (b, _) -> String.compare a b) (List.of_seq (Hashtbl.to_seq table.entries)) in
  Json.Object (List.map member sorted)

let parse path text =
  let at = ref 0 and line = ref 1 and size = String.length text in
  let fail what = bad_input "%s: line %d: %s" path !line what in
  if not (Utf8.is_valid text) then fail "is not UTF-8";
  String.iter (fun c -> if (c < ' ' && c <> '\t' && c <> '\n' && c <> '\r') || c = '\127' then
      fail "has a control character") text;
  let peek () = if !at < size then text.[!at] else '\000' in
  let is_end () = !at >= size in
  let expect c = if peek () = c && not (is_end ()) then incr at else fail (Printf.sprintf "expected '%c'" c) in
  let rec blanks () = if peek () = ' ' || peek () = '\t' then (incr at; blanks ()) in
  let comment () = if peek () = '#' then while not (is_end ()) && peek () <> '\n' do incr at done in
  let newline () =
    if peek () = '\r' then incr at;
    if not (is_end ()) then (expect '\n'; incr line) in
  let rec empty_lines () =
    blanks (); comment ();
    if not (is_end ()) && (peek () = '\n' || peek () = '\r') then (newline (); empty_lines ()) in
  let finish_line () = blanks (); comment (); newline () in
  let hex count =
    if !at + count > size then fail "an escape is cut short";
    let digits = String.sub text !at count in
    if not (String.for_all (fun c -> String.contains "0123456789abcdefABCDEF" c) digits) then fail "unknown escape";
    at := !at + count;
    let code = int_of_string ("0x" ^ digits) in
    if code > 0x10FFFF || (code >= 0xD800 && code < 0xE000) then fail "no character has this number";
    code in
  let basic () =
    expect '"';
    let buffer = Buffer.create 32 in
    let escape () = match peek () with
      | '"' | '\\' -> Buffer.add_char buffer (peek ()); incr at
      | 'b' -> Buffer.add_char buffer '\b'; incr at
      | 't' -> Buffer.add_char buffer '\t'; incr at
      | 'n' -> Buffer.add_char buffer '\n'; incr at
      | 'f' -> Buffer.add_char buffer '\012'; incr at
      | 'r' -> Buffer.add_char buffer '\r'; incr at
      | 'u' -> incr at; Utf8.add buffer (hex 4)
      | 'U' -> incr at; Utf8.add buffer (hex 8)
      | _ -> fail "unknown escape" in
    let rec go () = match peek () with
      | '"' -> incr at
      | '\\' -> incr at; escape (); go ()
      | '\n' | '\r' | '\000' -> fail "a text does not end on its line"
      | c -> Buffer.add_char buffer c; incr at; go () in
    go (); Buffer.contents buffer in
  let literal () =
    expect '\'';
    let first = !at in
    while (match peek () with '\'' | '\n' | '\r' | '\000' -> false | _ -> true) do incr at done;
    let result = String.sub text first (!at - first) in
    expect '\''; result in
  let run allowed =
    let first = !at in
    while not (is_end ()) && allowed (peek ()) do incr at done;
    String.sub text first (!at - first) in
  let key () = match peek () with
    | '"' -> basic ()
    | '\'' -> literal ()
    | _ ->
      let bare = run (function 'A' .. 'Z' | 'a' .. 'z' | '0' .. '9' | '_' | '-' -> true | _ -> false) in
      if bare = "" then fail "a key is missing"; bare in
  let rec dotted () =
    let first = key () in
    blanks ();
    if peek () = '.' then (incr at; blanks (); first :: dotted ()) else [ first ] in
  let number () =
    let word = run (function '0' .. '9' | '+' | '-' | '.' | 'e' | 'E' | '_' -> true | _ -> false) in
    let body = if word <> "" && (word.[0] = '+' || word.[0] = '-') then String.sub word 1 (String.length word - 1)
        else word in
    let is_digit c = c >= '0' && c <= '9' in
    let digit k = k >= 0 && k < String.length body && is_digit body.[k] in
    let well_formed k c = match c with
      | '_' -> digit (k - 1) && digit (k + 1)
      | '.' -> digit (k - 1) && digit (k + 1) && not (String.contains (String.sub body 0 k) '.')
      | 'e' | 'E' -> digit (k - 1)
      | '+' | '-' -> k > 0 && (body.[k - 1] = 'e' || body.[k - 1] = 'E') && digit (k + 1)
      | _ -> true in
    let count c = List.length (List.filter (( = ) c) (List.of_seq (String.to_seq (String.lowercase_ascii body)))) in
    let is_integer = String.for_all (fun c -> is_digit c || c = '_') body in
    if not (digit 0 && digit (String.length body - 1) && count 'e' <= 1) then fail "is no value that is read here";
    String.iteri (fun k c -> if not (well_formed k c) then fail "is not a number") body;
    if digit 1 && body.[0] = '0' then fail "a number begins with 0";
    let value = float_of_string (String.concat "" (String.split_on_char '_' word)) in
    if not (Float.is_finite value) then fail "a number is out of range";
    Json.Number { value; is_integer } in
  let word w value =
    let found = run (function 'a' .. 'z' -> true | _ -> false) in
    if found = w then Leaf (Json.Bool value) else fail "is no value that is read here" in
  let rec place table = function
    | [] -> assert false
    | [ last ] -> table, last
    | name :: rest ->
      (match Hashtbl.find_opt table.entries name with
       | Some (Table inner) when not inner.is_stated -> place inner rest
       | Some _ -> fail ("\"" ^ shown name ^ "\" appears twice")
       | None ->
         let inner = empty false in
         Hashtbl.add table.entries name (Table inner); place inner rest) in
  let rec value depth =
    if depth > 16 then fail "is nested too deep";
    match peek () with
    | '"' | '\'' when !at + 2 < size && String.sub text !at 3 = String.make 3 (peek ()) ->
      fail "a text on several lines is not read"
    | '"' -> Leaf (Json.Text (basic ()))
    | '\'' -> Leaf (Json.Text (literal ()))
    | '[' -> incr at; Leaf (Json.Array (array depth))
    | '{' -> incr at; Table (inline depth)
    | 't' -> word "true" true
    | 'f' -> word "false" false
    | _ -> Leaf (number ())
  and array depth =
    empty_lines ();
    if peek () = ']' then (incr at; []) else
    let element = match value (depth + 1) with Leaf json -> json | Table table -> json_of table in
    empty_lines ();
    if peek () = ',' then (incr at; element :: array depth) else (expect ']'; [ element ])
  and inline depth =
    let table = empty true in
    blanks ();
    if peek () = '}' then incr at else begin
      let rec go () =
        blanks (); pair table (depth + 1); blanks ();
        if peek () = ',' then (incr at; go ()) else expect '}' in
      go ()
    end;
    table
  and pair table depth =
    let names = dotted () in
    let inner, last = place table names in
    if Hashtbl.mem inner.entries last then fail ("\"" ^ shown last ^ "\" appears twice");
    expect '='; blanks ();
    Hashtbl.add inner.entries last (value depth) in
  let top = empty true in
  (* The table of a header; those on the way may have been stated before. *)
  let rec section table = function
    | [] -> if table.is_stated then fail "a table appears twice"; table.is_stated <- true; table
    | name :: rest ->
      (match Hashtbl.find_opt table.entries name with
       | Some (Table inner) -> section inner rest
       | Some (Leaf _) -> fail ("\"" ^ shown name ^ "\" appears twice")
       | None ->
         let inner = empty false in
         Hashtbl.add table.entries name (Table inner); section inner rest) in
  let current = ref top in
  let rec go () =
    empty_lines ();
    if not (is_end ()) then begin
      (if peek () = '[' then begin
         incr at; blanks ();
         if peek () = '[' then fail "lists of tables are not read";
         let names = dotted () in
         expect ']';
         current := section top names
       end else pair !current 0);
      finish_line (); go ()
    end in
  go ();
  json_of top

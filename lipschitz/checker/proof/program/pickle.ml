(* The pickles that torch.save writes of a state dict. An allow-list of opcodes and of names: nothing is executed. *)

open Refusal

type value =
  | None_ | Bool of bool | Int of int | Text of string | Real
  | Tuple of value list
  | List of value list ref  (* the last element first *)
  | Dict of (value * value) list ref  (* the last entry first *)
  | Global of string
  | Storage of { key : string; kind : string; elements : int }
  | Tensor of { storage : value; offset : int; sizes : int list; strides : int list }

(* The value whose pickle begins at `start`, and where the pickle ends. *)
let parse path bytes start =
  let at = ref start and stack = ref [] and marks = ref [] and memo = Hashtbl.create 64 and steps = ref 0 in
  let fail what = bad_input "%s: offset %d: %s" path !at what in
  let take n =
    if n < 0 || n > String.length bytes - !at then fail "the pickle is cut short";
    let part = String.sub bytes !at n in
    at := !at + n; part in
  let byte () = Char.code (take 1).[0] in
  let int16 () = String.get_uint16_le (take 2) 0 in
  let int32 () = Int32.to_int (String.get_int32_le (take 4) 0) in
  let push v = stack := v :: !stack in
  let pop () = match !stack with v :: rest -> stack := rest; v | [] ->
      fail "an opcode finds too few values on the stack" in
  let pop_marked () = match !marks with
    | saved :: rest -> let items = List.rev !stack in stack := saved; marks := rest; items
    | [] -> fail "an opcode finds no mark on the stack" in
  let line () =
    match String.index_from_opt bytes !at '\n' with
    | Some stop -> let part = String.sub bytes !at (stop - !at) in at := stop + 1; part
    | None -> fail "the pickle is cut short" in
  let rec pairs = function a :: b :: rest -> (a, b) :: pairs rest | [] -> [] | [ _ ] ->
      fail "a dict with a key and no value" in
  let top () = match !stack with v :: _ -> v | [] -> fail "an opcode finds too few values on the stack" in
  let extend items = match top () with
    | Dict entries -> entries := List.rev_append (pairs items) !entries
    | List elements -> elements := List.rev_append items !elements
    | _ -> fail "is neither a list nor a dict" in
  let recall k = match Hashtbl.find_opt memo k with Some v -> push v | None ->
      fail "an opcode recalls a value that was never stored" in
  let ints = List.map (function Int n when n >= 0 -> n | _ -> fail "a size that is no natural number") in
  let call f args = match f, args with
    | Global "collections.OrderedDict", [] -> Dict (ref [])
    | Global "torch._utils._rebuild_tensor_v2", (Storage _ as storage) :: Int offset :: Tuple sizes :: Tuple
        strides :: _
      when offset >= 0 && List.length sizes = List.length strides ->
          Tensor { storage; offset; sizes = ints sizes; strides = ints strides }
    | Global "torch._utils._rebuild_parameter", (Tensor _ as tensor) :: _ -> tensor
    | _ -> fail "calls something that is not part of a state dict" in
  let global name = match name with
    | "collections.OrderedDict" | "torch._utils._rebuild_tensor_v2" | "torch._utils._rebuild_parameter" ->
        push (Global name)
    | _ when Tensor.ends_with "Storage" name && String.length name < 40 && String.sub name 0 6 = "torch." ->
        push (Global name)
    | _ -> fail ("names " ^ shown name ^ ", which is not part of a state dict") in
  let persistent = function
    | Tuple (Text "storage" :: Global kind :: Text key :: Text _ :: Int elements :: _) when elements >= 0 ->
        push (Storage { key; kind; elements })
    | _ -> fail "a storage is not described as torch does" in
  let rec go () =
    incr steps;
    if !steps > 1_000_000 then fail "more opcodes than any state dict needs";
    match Char.chr (byte ()) with
    | '.' -> pop ()
    | opcode -> execute opcode; go ()
  and execute = function
    | '\x80' -> if byte () > 5 then fail "the pickle protocol is newer than 5"
    | '\x95' -> ignore (take 8)
    | '(' -> marks := !stack :: !marks; stack := []
    | 'N' -> push None_
    | '\x88' -> push (Bool true)
    | '\x89' -> push (Bool false)
    | 'K' -> push (Int (byte ()))
    | 'M' -> push (Int (int16 ()))
    | 'J' -> push (Int (int32 ()))
    | '\x8a' ->
      let digits = take (byte ()) in
      let size = String.length digits in
      if size > 7 then push Real else
      let value = ref 0 in
      for k = size - 1 downto 0 do value := (!value lsl 8) lor Char.code digits.[k] done;
      push (Int (if size > 0 && digits.[size - 1] >= '\x80' then !value - (1 lsl (8 * size)) else !value))
    | 'G' -> ignore (take 8); push Real
    | 'U' | '\x8c' -> push (Text (take (byte ())))
    | 'T' | 'X' -> push (Text (take (int32 ())))
    | ')' -> push (Tuple [])
    | 't' -> push (Tuple (pop_marked ()))
    | '\x85' -> let a = pop () in push (Tuple [ a ])
    | '\x86' -> let b = pop () in let a = pop () in push (Tuple [ a; b ])
    | '\x87' -> let c = pop () in let b = pop () in let a = pop () in push (Tuple [ a; b; c ])
    | ']' -> push (List (ref []))
    | '}' -> push (Dict (ref []))
    | 'a' -> let v = pop () in extend [ v ]
    | 'e' -> extend (pop_marked ())
    | 's' -> let v = pop () in let k = pop () in extend [ k; v ]
    | 'u' -> extend (pop_marked ())
    | 'q' -> Hashtbl.replace memo (byte ()) (top ())
    | 'r' -> Hashtbl.replace memo (int32 ()) (top ())
    | '\x94' -> Hashtbl.replace memo (Hashtbl.length memo) (top ())
    | 'h' -> recall (byte ())
    | 'j' -> recall (int32 ())
    | 'c' -> let space = line () in let name = line () in global (space ^ "." ^ name)
    | '\x93' ->
      (match pop (), pop () with
       | Text name, Text space -> global (space ^ "." ^ name) | _ -> fail "a name that is not text")
    | 'R' ->
      let args = match pop () with Tuple args -> args | _ -> fail "calls with something that is no tuple" in
      let f = pop () in push (call f args)
    | 'b' -> ignore (pop ())  (* version numbers that torch hangs onto the dict *)
    | 'Q' -> persistent (pop ())
    | _ -> fail "this pickle opcode is not part of a state dict" in
  let root = go () in
  root, !at

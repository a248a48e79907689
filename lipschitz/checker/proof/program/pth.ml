(* PyTorch state dicts: a zip archive without compression, or the legacy container of pickles. *)

open Refusal

let legacy_magic = "\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19."
let part_is bytes at text = at >= 0 && String.length bytes >= at + String.length text &&
    String.sub bytes at (String.length text) = text
let is_zip bytes = part_is bytes 0 "PK\003\004"
let looks_like bytes = is_zip bytes || (String.length bytes > 2 && bytes.[0] = '\x80' && part_is bytes 2 legacy_magic)

(* Name to contents of each entry, as the central directory lists them. *)
let zip_entries path bytes =
  let fail what = bad_input "%s: is not a complete zip archive (%s)" path what in
  let size = String.length bytes in
  let u16 at = if at < 0 || at + 2 > size then fail "cut short" else String.get_uint16_le bytes at in
  let u32 at = u16 at lor (u16 (at + 2) lsl 16) in
  let sub at n = if at < 0 || n < 0 || at > size - n then fail "cut short" else String.sub bytes at n in
  let rec end_record at =
    if at < max 0 (size - 65557) then fail "no end record"
    else if part_is bytes at "PK\005\006" && at + 22 + u16 (at + 20) = size then at else end_record (at - 1) in
  let record = end_record (size - 22) in
  let count = u16 (record + 10) in
  if count > 10_000 then fail "too many entries";
  let rec go at left found =
    if left = 0 then List.rev found else begin
      if not (part_is bytes at "PK\001\002") then fail "no entry where one is listed";
      let name = sub (at + 46) (u16 (at + 28)) and length = u32 (at + 24) and local = u32 (at + 42) in
      if u16 (at + 8) land 1 <> 0 || u16 (at + 10) <> 0 || u32 (at + 20) <> length then
          fail "an entry is compressed or encrypted";
      if not (part_is bytes local "PK\003\004") then fail "no entry where one is listed";
      if sub (local + 30) (u16 (local + 26)) <> name then fail "an entry has two names";
      if List.mem_assoc name found then fail "an entry appears twice";
      let contents = (local + 30 + u16 (local + 26) + u16 (local + 28)), length in
      ignore (sub (fst contents) 0);
      go (at + 46 + u16 (at + 28) + u16 (at + 30) + u16 (at + 32)) (left - 1) ((name, contents) :: found)
    end in
  List.map (fun (name, (at, length)) -> name, fun () -> sub at length) (go (u32 (record + 16)) count [])

(* The state dict that a dotted key leads to; of names that hold dots, the longest that fits. *)
let rec select path root key = match root, key with
  | Pickle.Dict entries, "" ->
    List.rev_map (function
        | Pickle.Text name, (Pickle.Tensor _ as tensor) -> name, tensor
        | Pickle.Text name, _ -> bad_input "%s: %s is not a tensor: choose a state dict with --key" path (shown name)
        | _ -> bad_input "%s: a key that is not text" path) !entries
  | Pickle.Dict entries, _ ->
    let fits = function
      | Pickle.Text name, value when name <> "" && (name = key || Tensor.starts_with (name ^ ".") key) ->
          Some (String.length name, value)
      | _ -> None in
    (match List.sort (fun (a, _) (b, _) -> compare b a) (List.filter_map fits !entries) with
     | (n, value) :: _ -> select path value (if n = String.length key then
         "" else String.sub key (n + 1) (String.length key - n - 1))
     | [] -> bad_input "%s: the file has no key \"%s\"" path (shown key))
  | _ -> bad_input "%s: is not a state dict (names and tensors)" path

let kind_of = function
  | "torch.FloatStorage" -> "float32" | "torch.DoubleStorage" -> "float64" | "torch.HalfStorage" -> "float16"
  | "torch.BFloat16Storage" -> "bfloat16" | other -> other

(* A view of one or two dimensions, row by row. *)
let numbers path name data kind ~offset ~sizes ~strides ~elements () =
  let last = List.fold_left2 (fun sum n stride -> sum + (n - 1) * stride) offset sizes strides in
  if String.length data <> elements * Tensor.width kind || last >= elements then
    bad_input "%s: %s: the view does not fit its storage" path (shown name);
  let rec indices base sizes strides = match sizes, strides with
    | n :: sizes, stride :: strides -> List.concat (List.init n (fun k -> indices (base + k * stride) sizes strides))
    | _ -> [ base ] in
  Array.of_list (List.map (Tensor.number_at kind data 0) (indices offset sizes strides))

let tensors path root key storage_data =
  let small n = n < 1 lsl 31 in
  List.map (function
      | name, Pickle.Tensor { storage = Pickle.Storage { key; kind; elements }; offset; sizes; strides } ->
        if not (List.for_all small (offset :: elements :: sizes @ strides)) then
            bad_input "%s: %s is too large" path (shown name);
        let kind = kind_of kind in
        let read () = numbers path name (storage_data key) kind ~offset ~sizes ~strides ~elements () in
        { Tensor.tensor = name; shape = sizes; kind; numbers = read }
      | name, _ -> bad_input "%s: %s is not a tensor" path (shown name)) (select path root key)

let read_zip path bytes ~key =
  let entries = zip_entries path bytes in
  let pickle = match List.find_opt (fun (name, _) ->
      match String.index_opt name '/' with Some at -> String.sub name at (String.length name - at) = "/data.pkl"
          | None -> false) entries with
    | Some (name, _) -> name | None -> bad_input "%s: the zip archive has no <folder>/data.pkl" path in
  let folder = String.sub pickle 0 (String.length pickle - 8) in
  let entry name = match List.assoc_opt name entries with Some read -> read () | None ->
      bad_input "%s: the archive has no %s" path (shown name) in
  if List.exists (fun (name, _) -> name = folder ^ "constants.pkl" ||
      Tensor.starts_with (folder ^ "code/") name) entries then
    bad_input "%s: is a TorchScript program, not a state dict" path;
  if List.mem_assoc (folder ^ "byteorder") entries && entry (folder ^ "byteorder") <> "little" then
    bad_input "%s: the numbers are not little-endian" path;
  let root, _ = Pickle.parse path (entry pickle) 0 in
  tensors path root key (fun storage -> entry (folder ^ "data/" ^ storage))

let storage_bytes = [ "torch.FloatStorage", 4; "torch.DoubleStorage", 8; "torch.HalfStorage", 2;
    "torch.BFloat16Storage", 2; "torch.LongStorage", 8;
                      "torch.IntStorage", 4; "torch.ShortStorage", 2; "torch.CharStorage", 1; "torch.ByteStorage", 1;
                          "torch.BoolStorage", 1 ]

(* Magic number, protocol, system, state, names of storages; then each storage behind its number of elements. *)
let read_legacy path bytes ~key =
  let version, at = Pickle.parse path bytes (2 + String.length legacy_magic) in
  if version <> Pickle.Int 1001 then bad_input "%s: protocol version must be 1001" path;
  let system, at = Pickle.parse path bytes at in
  (match system with
   | Pickle.Dict entries when List.assoc_opt (Pickle.Text "little_endian") !entries = Some (Pickle.Bool true) -> ()
   | _ -> bad_input "%s: the numbers are not little-endian" path);
  let root, at = Pickle.parse path bytes at in
  let names, at = Pickle.parse path bytes at in
  let names = match names with
    | Pickle.List names -> List.rev_map (function Pickle.Text name -> name | _ ->
        bad_input "%s: a storage without a name" path) !names
    | _ -> bad_input "%s: list of storages: is not a list" path in
  let widths = Hashtbl.create 16 in
  let rec collect depth = function
    | Pickle.Dict entries when depth < 16 -> List.iter (fun (_, v) -> collect (depth + 1) v) !entries
    | Pickle.Tensor { storage = Pickle.Storage { key; kind; _ }; _ } ->
      (match List.assoc_opt kind storage_bytes with
       | Some width -> Hashtbl.replace widths key width | None ->
           bad_input "%s: numbers of type %s cannot be skipped" path (shown kind))
    | _ -> () in
  collect 0 root;
  let located = Hashtbl.create 16 in
  let place at name =
    let width = match Hashtbl.find_opt widths name with Some w -> w | None ->
        bad_input "%s: a storage belongs to no tensor" path in
    if at + 8 > String.length bytes then bad_input "%s: is cut short" path;
    let count = Int64.to_int (String.get_int64_le bytes at) in
    if count < 0 || count > (String.length bytes - at - 8) / width then bad_input "%s: is cut short" path;
    Hashtbl.replace located name (String.sub bytes (at + 8) (count * width));
    at + 8 + count * width in
  ignore (List.fold_left place at names);
  tensors path root key (fun storage -> match Hashtbl.find_opt located storage with
      | Some data -> data | None -> bad_input "%s: a storage is missing" path)

let read path bytes ~key ~order =
  let tensors = if is_zip bytes then read_zip path bytes ~key else read_legacy path bytes ~key in
  Weights.assemble ~path ~sha256:(Sha256.to_hex (Sha256.string bytes)) Layer_order.Registration ~order tensors

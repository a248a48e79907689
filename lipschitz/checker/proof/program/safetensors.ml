(* safetensors: a length, a JSON header, and the numbers. *)

open Refusal

let order_key = "swarmcert.layers"

let looks_like bytes =
  String.length bytes >= 10 && Int64.unsigned_compare (String.get_int64_le bytes 0) (Int64.of_int (4 lsl 20)) <= 0 &&
      bytes.[8] = '{'

let counts path field json =
  let number = function
    | Json.Number { value; is_integer = true } when value >= 0. && value < 0x1p53 -> int_of_float value
    | _ -> bad_input "%s: %s holds something that is not a non-negative integer" path field in
  match json with
  | Some (Json.Array elements) when List.length elements <= 8 -> List.map number elements
  | _ -> bad_input "%s: %s is not a list of at most 8 numbers" path field

(* The order of the layers that our own files state. *)
let stated_order path header =
  match List.assoc_opt "__metadata__" header with
  | None -> []
  | Some (Json.Object metadata) ->
    (match List.assoc_opt order_key metadata with
     | None -> []
     | Some (Json.Text names) ->
       (match Json.parse path names with
        | Json.Array names -> List.map (function Json.Text n -> n | _ ->
            bad_input "%s: %s is not a list of layers" path order_key) names
        | _ -> bad_input "%s: %s is not a list of layers" path order_key)
     | Some _ -> bad_input "%s: %s is not text" path order_key)
  | Some _ -> bad_input "%s: __metadata__ is not an object" path

(* The tensors cover the data without overlap or gap. *)
let check_layout path ranges size =
  let covered = List.fold_left (fun covered (first, last) ->
      if first <> covered then bad_input "%s: data_offsets overlap or leave a gap at %d" path covered;
      last) 0 (List.sort compare ranges) in
  if covered <> size then bad_input "%s: %d bytes belong to no tensor" path (size - covered)

let read path bytes ~order =
  let length = Int64.to_int (String.get_int64_le bytes 0) in
  if length > String.length bytes - 8 then bad_input "%s: the header is longer than the file" path;
  let header = match Json.parse path (String.sub bytes 8 length) with
    | Json.Object members -> members | _ -> bad_input "%s: the header is not an object" path in
  let first = 8 + length in
  let size = String.length bytes - first in
  let tensor (name, json) =
    let members = match json with Json.Object m -> m | _ -> bad_input "%s: %s is not an object" path (shown name) in
    List.iter (fun (key, _) -> if not (List.mem key [ "dtype"; "shape"; "data_offsets" ]) then
                  bad_input "%s: %s: %s is not a known key" path (shown name) (shown key)) members;
    let kind = match List.assoc_opt "dtype" members with
      | Some (Json.Text "F32") -> "float32" | Some (Json.Text "F64") -> "float64"
      | Some (Json.Text "F16") -> "float16" | Some (Json.Text "BF16") -> "bfloat16" | Some (Json.Text other) -> other
      | _ -> bad_input "%s: %s has no dtype" path (shown name) in
    let shape = counts path (shown name ^ ".shape") (List.assoc_opt "shape" members) in
    match counts path (shown name ^ ".data_offsets") (List.assoc_opt "data_offsets" members) with
    | [ b; e ] when b <= e && e <= size ->
      let numbers () =
        let count = List.fold_left ( * ) 1 shape in
        if count * Tensor.width kind <> e - b then bad_input "%s: %s.shape does not fit its data" path (shown name);
        Array.init count (Tensor.number_at kind bytes (first + b)) in
      { Tensor.tensor = name; shape; kind; numbers }, (b, e)
    | _ -> bad_input "%s: %s.data_offsets is no range in the data" path (shown name) in
  let found = List.map tensor (List.filter (fun (name, _) -> name <> "__metadata__") header) in
  check_layout path (List.map snd found) size;
  let stated = stated_order path header in
  let layer (t : Tensor.t) = match String.rindex_opt t.tensor '.' with Some dot ->
      String.sub t.tensor 0 dot | None -> "" in
  let rank t =
    let rec go k = function [] -> k | name :: rest -> if name = layer t then k else go (k + 1) rest in go 0 stated in
  let before a b =
    let by_rank = compare (rank a) (rank b) in
    if by_rank <> 0 then by_rank
    else if Layer_order.naturally_before a.Tensor.tensor b.Tensor.tensor then -1 else 1 in
  let tensors = List.stable_sort before (List.map fst found) in
  let listing = if List.for_all (fun t -> rank t < List.length stated) tensors then
      Layer_order.Evaluation else Unordered in
  Weights.assemble ~path ~sha256:(Sha256.to_hex (Sha256.string bytes)) listing ~order tensors

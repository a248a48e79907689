(* ONNX models as they lie in their files: nodes, stored tensors, the graph's input and outputs. *)

open Refusal

(* `numbers` and `integers`: of a type that is read, row by row; otherwise none. *)
type tensor = { name : string; shape : int list; kind : int; numbers : float array; integers : int list }
type attribute = { number : float option; word : string option; tensor : tensor option; listed : int list;
                   floats : float array }
(* `parts`: the nodes that this one stands for. *)
type node = { op : string; label : string; inputs : string list; outputs : string list;
              attributes : (string * attribute) list; parts : node list }
(* Of the input; a size is 0 where the file leaves it open. *)
type t = { nodes : node list; tensors : (string, tensor) Hashtbl.t; input : string; shape : int list; output : string;
           operator_set : int  (* of ONNX itself; 0: not stated *) }

let float32 = 1 and int32 = 6 and int64 = 7 and boolean = 9 and float64 = 11
(* By their number: the name, and the field of numbers that are not raw. *)
let floats = [ float32, ("float32", 4); float64, ("float64", 10); 10, ("float16", 5); 16, ("bfloat16", 5) ]
let is_float kind = List.mem_assoc kind floats
let is_integer kind = List.mem kind [ int32; int64; boolean ]
let export = "export a plain chain of linear layers with ReLU between them: torch.onnx.export(model, ...)"
(* What a node is refused for, and what to do. *)
exception Refused of string * string
let refuse ?(hint = export) format = Printf.ksprintf (fun what -> raise (Refused (what, hint))) format

(* Field 1, the IR version, and the tag of another field of a model. *)
let looks_like bytes =
  String.length bytes >= 3 && bytes.[0] = '\x08' && bytes.[1] >= '\001' && bytes.[1] <= '\031'
  && String.contains "\x12\x1a\x22\x28\x32\x3a\x42" bytes.[2]

let all number fields = List.filter_map (fun (n, value) -> if n = number then Some value else None) fields
let texts path number fields = List.map (Protobuf.bytes path) (all number fields)
(* The last one counts, as in every protobuf reader. *)
let last_of = function [] -> None | values -> Some (List.nth values (List.length values - 1))
let text path number fields = Option.value (last_of (texts path number fields)) ~default:""
let integer path number fields = match last_of (all number fields) with
  | Some (Protobuf.Number n) -> Int64.to_int n | None -> 0 | _ -> bad_input "%s: a number of another type" path

(* min_int where a number is beyond the range of sizes. *)
let small n = if Int64.compare n (-0x7FFFFFFFL) > 0 && Int64.compare n 0x7FFFFFFFL < 0 then Int64.to_int n else min_int

(* What a tensor holds in its only field of numbers. *)
let integers path kind data = match data with
  | Some (9, Protobuf.Bytes raw) when kind = int64 ->
    List.init (String.length raw / 8) (fun k -> small (String.get_int64_le raw (8 * k)))
  | Some (9, Protobuf.Bytes raw) when kind = int32 ->
    List.init (String.length raw / 4) (fun k -> Int32.to_int (String.get_int32_le raw (4 * k)))
  | Some (9, Protobuf.Bytes raw) when kind = boolean -> List.init (String.length raw) (fun k -> Char.code raw.[k])
  | Some (number, listed) when number = (if kind = int64 then 7 else 5) && is_integer kind ->
    List.map small (Protobuf.integers path listed)
  | _ -> []
let numbers path (kind, field) data =
  let raw data = Array.init (String.length data / Tensor.width kind) (Tensor.number_at kind data 0) in
  match data with
  | Some (9, Protobuf.Bytes data) -> raw data
  | Some (number, Protobuf.Bytes data) when number = field && field <> 5 -> raw data
  | Some (5, listed) when field = 5 ->
    let half bits = Tensor.of_half kind (Int64.to_int bits land 0xffff) in
    Array.of_list (List.map half (Protobuf.integers path listed))
  | _ -> [||]

let size shape = List.fold_left ( * ) 1 shape

let tensor path message =
  let fields = Protobuf.fields path message in
  let name = text path 8 fields and kind = integer path 2 fields in
  let size_of n = if Int64.compare n 0L < 0 || Int64.compare n 0x7FFFFFFFL > 0 then
      bad_input "%s: %s has an impossible shape" path (shown name) else Int64.to_int n in
  let shape = List.map size_of (List.concat_map (Protobuf.integers path) (all 1 fields)) in
  if all 13 fields <> [] || integer path 14 fields <> 0 then bad_input
      "%s: %s: its numbers lie in another file" path (shown name);
  let refuse what = bad_input "%s: %s %s; export the model again" path (shown name) what in
  let data = match List.filter (fun (n, _) -> List.mem n [ 4; 5; 7; 9; 10 ]) fields with
    | [] -> None
    | [ (n, Protobuf.Bytes data) ] -> Some (n, Protobuf.Bytes data)
    | _ -> refuse "holds numbers that are not in one piece" in
  let count = Tensor.count shape in
  if count > Tensor.most_numbers then refuse "is too large";
  let numbers = match List.assoc_opt kind floats with Some float -> numbers path float data | None -> [||] in
  let integers = integers path kind data in
  if is_float kind && Array.length numbers <> count || is_integer kind && List.length integers <> count
  then refuse "holds another number of numbers than its shape";
  { name; shape; kind; numbers; integers }

let attribute path message =
  let fields = Protobuf.fields path message in
  let number = last_of (List.filter_map (function
      | 2, Protobuf.Fixed four when String.length four = 4 ->
        Some (Int32.float_of_bits (String.get_int32_le four 0))
      | 3, Protobuf.Number n -> Some (Int64.to_float n)
      | _ -> None) fields) in
  let tensor = Option.map (tensor path) (last_of (texts path 5 fields)) in
  let listed = List.concat_map (Protobuf.integers path) (all 8 fields) in
  let floats = function
    | Protobuf.Fixed data | Protobuf.Bytes data when String.length data mod 4 = 0 ->
      numbers path ("float32", 4) (Some (9, Protobuf.Bytes data))
    | _ -> [||] in
  text path 1 fields, { number; word = last_of (texts path 4 fields); tensor; listed = List.map small listed;
                        floats = Array.concat (List.map floats (all 7 fields)) }

let node path message =
  let fields = Protobuf.fields path message in
  let op = text path 4 fields and name = text path 3 fields and domain = text path 7 fields in
  let label = shown op ^ (if name = "" then "" else Printf.sprintf " \"%s\"" (shown name)) in
  if domain <> "" && domain <> "ai.onnx" then
    bad_input "%s: node %s is of an operator set that cannot be read" path label;
  let outputs = texts path 2 fields in
  (* Dropout and BatchNormalization have further ones, unused in inference; TopK gives places as well. *)
  let may_have_more = List.mem op [ "Dropout"; "BatchNormalization"; "TopK"; "Split" ] in
  if outputs = [] || (List.length outputs > 1 && not may_have_more) then
    bad_input "%s: node %s has not exactly one output" path label;
  { op; label; inputs = texts path 1 fields; outputs; attributes = List.map (attribute path) (texts path 5 fields);
    parts = [] }

let output node = List.hd node.outputs
let found name node = List.assoc_opt name (List.rev node.attributes)
let has name node = found name node <> None
let number node name otherwise = match found name node with Some { number = Some x; _ } -> x | _ -> otherwise
let word node name otherwise = match found name node with Some { word = Some w; _ } -> w | _ -> otherwise
let listed node name otherwise = match found name node with Some a -> a.listed | None -> otherwise
(* An integer, or an end of its range. *)
let whole node name otherwise =
  let x = number node name (float_of_int otherwise) in
  if Float.abs x < 0x1p30 then int_of_float x else if x > 0. then max_int / 2 else min_int / 2

let input_shape path message =
  let parts number messages = List.concat_map (fun m -> texts path number (Protobuf.fields path m)) messages in
  let size_of dimension =
    let n = integer path 1 (Protobuf.fields path dimension) in
    if n < 0 || n > Folding.most_numbers then 0 else n in
  let tensors = parts 1 (parts 2 [ message ]) in
  match parts 2 tensors with [] -> [ 1; 0 ] | shapes -> List.map size_of (parts 1 shapes)

let operator_set path model =
  let version found message =
    let fields = Protobuf.fields path message in
    if List.mem (text path 1 fields) [ ""; "ai.onnx" ] then integer path 2 fields else found in
  List.fold_left version 0 (texts path 8 model)

let require_single_names path names =
  let names = List.filter (( <> ) "") names in
  if List.length (List.sort_uniq compare names) <> List.length names then
    bad_input "%s: two values have the same name" path

let read path bytes =
  let model = Protobuf.fields path bytes in
  let graph = match texts path 7 model with
    | [ graph ] -> Protobuf.fields path graph | _ -> bad_input "%s: has not one graph" path in
  if all 15 graph <> [] then bad_input "%s: sparse tensors cannot be read" path;
  let tensors = Hashtbl.create 16 in
  List.iter (fun message ->
      let t = tensor path message in
      if Hashtbl.mem tensors t.name then bad_input "%s: %s appears twice" path (shown t.name);
      Hashtbl.add tensors t.name t) (texts path 5 graph);
  let name_of message = text path 1 (Protobuf.fields path message) in
  let inputs = List.filter (fun m -> not (Hashtbl.mem tensors (name_of m))) (texts path 11 graph) in
  let input = match inputs with [ one ] -> one | _ -> bad_input "%s: the graph has not one input" path in
  let output = match texts path 12 graph with
    | [ one ] -> name_of one | _ -> bad_input "%s: the graph has not one output" path in
  let nodes = texts path 1 graph in
  if List.length nodes > 10_000 then bad_input "%s: the graph has more than 10000 nodes" path;
  let nodes = List.map (node path) nodes in
  require_single_names path
    (name_of input :: Hashtbl.fold (fun name _ names -> name :: names) tensors []
     @ List.concat_map (fun node -> node.outputs) nodes);
  { nodes; tensors; input = name_of input; shape = input_shape path input; output;
    operator_set = operator_set path model }

(* ONNX models that are a chain of linear layers with one activation between them. *)

open Refusal

type stored = { name : string; shape : int list; kind : int; raw : string }
type attribute = { number : float option; word : string; tensor : stored option }
type node = { op : string; inputs : string list; output : string; attributes : (string * attribute) list }
type affine = { weight : stored; transposed : bool; mutable bias : stored option }

(* Field 1, the IR version, and the tag of another field of a model. *)
let looks_like bytes =
  String.length bytes >= 3 && bytes.[0] = '\x08' && bytes.[1] >= '\001' && bytes.[1] <= '\031'
  && String.contains "\x12\x1a\x22\x28\x32\x3a\x42" bytes.[2]

let all number fields = List.filter_map (fun (n, value) -> if n = number then Some value else None) fields
let texts path number fields = List.map (Protobuf.bytes path) (all number fields)
(* The last one counts, as in every protobuf reader. *)
let text path number fields = match List.rev (texts path number fields) with t :: _ -> t | [] -> ""
let integer path number fields = match List.rev (all number fields) with
  | Protobuf.Number n :: _ -> Int64.to_int n | [] -> 0 | _ -> bad_input "%s: a number of another type" path

let tensor path message =
  let fields = Protobuf.fields path message in
  let name = text path 8 fields and kind = integer path 2 fields in
  let size n = if Int64.compare n 0L < 0 || Int64.compare n 0x7FFFFFFFL > 0 then
      bad_input "%s: %s has an impossible shape" path (shown name) else Int64.to_int n in
  let shape = List.map size (List.concat_map (Protobuf.integers path) (all 1 fields)) in
  if all 13 fields <> [] || integer path 14 fields <> 0 then bad_input
      "%s: %s: its numbers lie in another file" path (shown name);
  let data = List.filter (fun (n, _) -> n = 4 || n = 9 || n = 10) fields in
  let width = match kind with 1 -> 4 | 11 -> 8 | _ -> 0 in
  let raw = match data with
    | [ (n, Protobuf.Bytes raw) ] when n = 9 || n = (if kind = 1 then 4 else 10) -> raw
    | _ when width = 0 -> ""
    | [] -> ""
    | _ -> bad_input "%s: %s: its numbers are not in one piece" path (shown name) in
  let count = List.fold_left (fun product n -> if n > 0 && product > Weights.most_numbers / n then
      bad_input "%s: %s is too large" path (shown name) else product * n) 1 shape in
  if width > 0 && String.length raw <> count * width then bad_input
      "%s: %s holds another number of numbers than its shape" path (shown name);
  { name; shape; kind; raw }

let attribute path message =
  let fields = Protobuf.fields path message in
  let number = match all 2 fields, all 3 fields with
    | Protobuf.Fixed four :: _, _ when String.length four = 4 -> Some (Int32.float_of_bits (String.get_int32_le four 0))
    | _, Protobuf.Number n :: _ -> Some (Int64.to_float n)
    | _ -> None in
  let tensor = match texts path 5 fields with t :: _ -> Some (tensor path t) | [] -> None in
  text path 1 fields, { number; word = text path 4 fields; tensor }

let node path message =
  let fields = Protobuf.fields path message in
  let domain = text path 7 fields in
  if domain <> "" && domain <> "ai.onnx" then bad_input "%s: a node is of an operator set that cannot be read" path;
  match texts path 2 fields with
  | [ output ] -> { op = text path 4 fields; inputs = texts path 1 fields; output;
      attributes = List.map (attribute path) (texts path 5 fields) }
  | _ -> bad_input "%s: a node has not exactly one output" path

type state = {
  mutable layers : affine list;
  mutable is_activated : bool;
  mutable activation : Proved.activation option;
}

(* Only with the parameters that the activations have here. Selu has float32 constants, with which it is 3e-9 steeper
   than with the decimals of the statement: another function. *)
let activation_of node =
  let is name expected = match List.assoc_opt name node.attributes with
    | None -> true | Some { number; _ } -> number = Some expected in
  let is_exact = match List.assoc_opt "approximate" node.attributes with
    | None -> true | Some { word; _ } -> word = "none" in
  match node.op with
  | "Relu" -> Some Proved.Relu
  | "Tanh" -> Some Tanh
  | "Sigmoid" -> Some Sigmoid
  | "Softplus" -> Some Softplus
  | "Elu" | "Celu" when is "alpha" 1. -> Some Elu
  | "Swish" when is "alpha" 1. -> Some Silu
  | "Gelu" when is_exact -> Some Gelu
  | _ -> None

(* Exporters write SiLU as the product of x and Sigmoid(x). *)
let rec with_products_joined = function
  | { op = "Sigmoid"; inputs = [ x ]; output = s; _ } :: { op = "Mul"; inputs = [ a; b ]; output; _ } :: rest
    when (a = x && b = s) || (a = s && b = x) ->
    { op = "Swish"; inputs = [ x ]; output; attributes = [] } :: with_products_joined rest
  | node :: rest -> node :: with_products_joined rest
  | [] -> []

let follow path kept state current node =
  let refuse what = bad_input "%s: node %s: %s" path (shown node.op) what in
  let keep tensor =
    if Hashtbl.mem kept node.output then refuse "stores a tensor twice";
    Hashtbl.add kept node.output { tensor with name = node.output } in
  let stored name = match Hashtbl.find_opt kept name with Some t -> t | None -> refuse "lacks its weights or biases" in
  let number name otherwise = match List.assoc_opt name node.attributes with
    | None -> otherwise | Some { number = Some x; _ } -> x | Some _ -> -1. in
  let start weight transposed =
    if state.layers <> [] && not state.is_activated then refuse "two linear layers without an activation between them";
    state.is_activated <- false;
    state.layers <- { weight; transposed; bias = None } :: state.layers in
  let add_bias bias = match state.layers with
    | ({ bias = None; _ } as layer) :: _ when not state.is_activated ->
      layer.bias <- Some (match bias.shape with [ 1; n ] -> { bias with shape = [ n ] } | _ -> bias)
    | _ -> refuse "adds where no layer takes a bias" in
  match node.op, node.inputs with
  | "Constant", [] ->
    (match List.assoc_opt "value" node.attributes with
     | Some { tensor = Some t; _ } -> keep t; current | _ -> refuse "holds no tensor")
  | "Identity", [ input ] when Hashtbl.mem kept input -> keep (stored input); current
  | op, inputs ->
    if List.length (List.filter (( = ) current) inputs) <> 1 then refuse "does not take the value before it once";
    List.iter (fun name -> if name <> current && name <> "" && not (Hashtbl.mem kept name) then
                  refuse "takes what is neither the value before it nor stored") inputs;
    (match op, inputs with
     | "Gemm", (first :: weight :: rest) when first = current && weight <> "" && List.length rest <= 1 ->
       if number "alpha" 1. <> 1. || number "beta" 1. <> 1. || number "transA" 0. <> 0. then
           refuse "scales or transposes";
       start (stored weight) (number "transB" 0. = 0.);
       (match rest with [ bias ] when bias <> "" -> add_bias (stored bias) | _ -> ())
     | "MatMul", [ first; weight ] when first = current -> start (stored weight) true
     | "Add", [ a; b ] -> add_bias (stored (if a = current then b else a))
     | "Identity", [ _ ] -> ()
     | _, [ _ ] when activation_of node <> None ->
       if state.layers = [] || state.is_activated then refuse "does not follow a linear layer";
       let activation = activation_of node in
       if state.activation <> None && state.activation <> activation then
         refuse "is another activation than that before it";
       state.activation <- activation;
       state.is_activated <- true
     | _ -> refuse "is not Gemm, MatMul of the input with weights, Add, Identity or an activation that is known");
    node.output

let layer_name names k weight =
  let name = if String.length weight > 7 && Weights.ends_with ".weight" weight then
      String.sub weight 0 (String.length weight - 7) else weight in
  let rec free name =
    if name <> "" && not (Hashtbl.mem names name) then name
    else free (Printf.sprintf "layer%d%s" (k + 1) (if name = "" then "" else "_" ^ name)) in
  let name = free name in
  Hashtbl.add names name (); name

let declared tensor name transposed =
  let kind = match tensor.kind with 1 -> "float32" | 11 -> "float64" | n -> Printf.sprintf "data type %d" n in
  let at k = Weights.number_at kind tensor.raw 0 k in
  match tensor.shape with
  | [ rows; columns ] when transposed ->
    let numbers () = Array.init (rows * columns) (fun k -> at ((k mod rows) * columns + k / rows)) in
    { Weights.tensor = name; shape = [ columns; rows ]; kind; numbers }
  | shape -> { Weights.tensor = name; shape; kind; numbers = (fun () -> Array.init (List.fold_left ( * ) 1 shape) at) }

let read path bytes ~order =
  let graph = match texts path 7 (Protobuf.fields path bytes) with
    | [ graph ] -> Protobuf.fields path graph | _ -> bad_input "%s: has not one graph" path in
  if all 15 graph <> [] then bad_input "%s: sparse tensors cannot be read" path;
  let kept = Hashtbl.create 16 in
  List.iter (fun message ->
      let t = tensor path message in
      if Hashtbl.mem kept t.name then bad_input "%s: %s appears twice" path (shown t.name);
      Hashtbl.add kept t.name t) (texts path 5 graph);
  let name_of message = text path 1 (Protobuf.fields path message) in
  let inputs = List.filter (fun name -> not (Hashtbl.mem kept name)) (List.map name_of (texts path 11 graph)) in
  let input = match inputs with [ one ] -> one | _ -> bad_input "%s: the graph has not one input" path in
  let nodes = List.map (node path) (texts path 1 graph) in
  if List.length nodes > 10_000 then bad_input "%s: the graph has more than 10000 nodes" path;
  let state = { layers = []; is_activated = false; activation = None } in
  let last = List.fold_left (follow path kept state) input (with_products_joined nodes) in
  if List.map name_of (texts path 12 graph) <> [ last ] then bad_input
      "%s: the graph's output is not where its chain of nodes ends" path;
  if state.layers = [] || state.is_activated then bad_input "%s: has no linear layer, or ends in an activation" path;
  let names = Hashtbl.create 16 in
  let tensors = List.concat (List.mapi (fun k layer ->
      let name = layer_name names k layer.weight.name in
      declared layer.weight (name ^ ".weight") layer.transposed
      :: (match layer.bias with Some b -> [ declared b (name ^ ".bias") false ] | None -> []))
          (List.rev state.layers)) in
  Weights.assemble ?activation:state.activation ~path ~sha256:(Sha256.to_hex (Sha256.string bytes))
    Layer_order.Evaluation ~order tensors

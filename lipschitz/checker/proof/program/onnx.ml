(* ONNX models as chains of layers: every value of the graph is followed as an affine map of what leaves the last layer,
   and piecewise linear functions are written with ReLU. *)

open Refusal
open Enclosed
open Onnx_model
module Operators = Onnx_operators

(* `first`: the weights that are the first ones since the last layer; "": none yet. *)
type value = { map : Folding.map; shape : int list; first : string }
type graph = {
  model : Onnx_model.t;
  chain : Folding.t;
  values : (string, value) Hashtbl.t;  (* that later nodes take *)
  uses : (string, int) Hashtbl.t;  (* by later nodes *)
  names : (string, unit) Hashtbl.t;  (* of layers *)
}

let operators =
  "is none of the operators that are read: Gemm, MatMul, Conv, BatchNormalization, AveragePool, MaxPool, Add, Sub, \
   Mul, Div, Relu, LeakyRelu, PRelu, Clip, HardSigmoid, Abs, Max, Min, Tanh, Sigmoid, Softplus, Elu, Gelu, TopK, \
   Split with Max and Min for MaxMin, Flatten, Reshape, Transpose, Concat and the like"

let layer_name graph weight =
  let name = if String.length weight > 7 && Tensor.ends_with ".weight" weight then
      String.sub weight 0 (String.length weight - 7) else weight in
  let number = Hashtbl.length graph.names + 1 in
  let rec free name =
    if name <> "" && not (Hashtbl.mem graph.names name) then name
    else free (Printf.sprintf "layer%d%s" number (if name = "" then "" else "_" ^ name)) in
  let name = free name in
  Hashtbl.add graph.names name (); name

let is_stored graph name = Hashtbl.mem graph.model.tensors name
let is_value graph name = Hashtbl.mem graph.values name
let count graph name = Option.value (Hashtbl.find_opt graph.uses name) ~default:0
(* Further inputs of these two are no values. *)
let inputs_that_count node = match node.op, node.inputs with
  | ("BatchNormalization" | "Dropout"), first :: _ -> [ first ]
  | _, inputs -> inputs

let input node k = Option.value (List.nth_opt node.inputs k) ~default:""
let value graph node k = match Hashtbl.find_opt graph.values (input node k) with
  | Some value -> value | None -> refuse "does not use the output of the preceding node"
(* Input k if it is stored; None if the node leaves it out. *)
let constant graph node k = match input node k with
  | "" -> None
  | name -> match Hashtbl.find_opt graph.model.tensors name with
    | Some tensor -> Some tensor
    | None -> refuse "uses \"%s\" as an input that must be stored" (shown name)
let needed_constant graph node k = match constant graph node k with
  | Some tensor -> tensor | None -> refuse "lacks its weights or biases"
(* The numbers of input k of an elementwise node, one for each entry of `shape`. *)
let broadcast graph node k shape =
  let tensor = needed_constant graph node k in
  Operators.require_trailing_axes node tensor shape ~operator_set:graph.model.operator_set;
  Operators.broadcast tensor shape
(* An attribute of older models, and input k of newer ones. *)
let integers graph node k name =
  if has name node then listed node name [] else match constant graph node k with
    | Some tensor -> tensor.integers | None -> []

(* The names of the values computed so far that nodes behind this one take. *)
let needed_behind graph node =
  let own name = List.length (List.filter (( = ) name) node.inputs) in
  List.sort compare (List.filter (fun name -> count graph name > own name)
                       (List.of_seq (Hashtbl.to_seq_keys graph.values)))
(* A new layer, which `add` makes of maps that are carried past it: `also`, and what is needed later. *)
let with_layer graph node also add =
  let needed = needed_behind graph node in
  let maps = List.map (fun name -> (Hashtbl.find graph.values name).map) needed in
  let result, behind = add (also @ maps) in
  let count = List.length also in
  let also, maps = Operators.first_of count behind, Operators.from count behind in
  List.iter2 (fun name map ->
      Hashtbl.replace graph.values name { (Hashtbl.find graph.values name) with map }) needed maps;
  Hashtbl.filter_map_inplace (fun _ value -> Some { value with first = "" }) graph.values;
  result, also
let relu graph node map first also =
  let name = layer_name graph first in
  with_layer graph node also (Folding.relu graph.chain name map)

let parts_of map n =
  List.init (Folding.size map / n) (fun k -> Folding.selected map (Array.init n (fun i -> k * n + i)))
(* shift + the sum of factors relu(terms). *)
let sum_of_relus graph node x terms ?shift () =
  let rectified, _ = relu graph node (Folding.stacked (List.map fst terms)) x.first [] in
  let parts = List.map2 Folding.scaled (parts_of rectified (size x.shape)) (List.map snd terms) in
  let map = List.fold_left (fun sum part -> Folding.sum sum part) (List.hd parts) (List.tl parts) in
  { map = (match shift with Some amounts -> Folding.shifted map amounts | None -> map); shape = x.shape; first = "" }
let once _ = one
let minus_once _ = exactly (-1.)

(* min(max(x, least), most) = least + relu(x - least) - relu(x - most); each limit may be missing. *)
let clipped graph node x least most =
  let limits outwards = function
    | None -> None
    | Some tensor ->
      let numbers = Operators.broadcast tensor x.shape in
      (* The largest float32 means none. *)
      if Array.for_all (fun n -> outwards *. n.value > 0x1p127) numbers then None
      else if Array.for_all (fun n -> Float.abs n.value <= 0x1p127) numbers then Some (Array.get numbers)
      else
        refuse ~hint:"leave out a limit that no value reaches" "its minimum or maximum is not a number within 2^127" in
  match limits (-1.) least, limits 1. most with
  | None, None -> x
  | Some low, None -> sum_of_relus graph node x [ Folding.shifted ~minus:true x.map low, once ] ~shift:low ()
  | None, Some high ->
    sum_of_relus graph node x [ Folding.shifted (Folding.negated x.map) high, minus_once ] ~shift:high ()
  | Some low, Some high ->
    if List.exists (fun k -> (low k).value > (high k).value) (List.init (size x.shape) Fun.id) then
      refuse "its minimum is above its maximum";
    sum_of_relus graph node x
      [ Folding.shifted ~minus:true x.map low, once; Folding.shifted ~minus:true x.map high, minus_once ] ~shift:low ()
let a_number x = { name = ""; shape = []; kind = float64; numbers = [| x |]; integers = [] }

(* The largest entry of each window, by max(a, b) = b + relu(a - b) of two and two. *)
let rec largest graph node x windows shape =
  if Array.for_all (fun window -> List.length window = 1) windows then
    { map = Folding.selected x.map (Array.map List.hd windows); shape; first = x.first }
  else begin
    let rec paired = function
      | a :: b :: rest -> let pairs, alone = paired rest in (a, b) :: pairs, alone
      | alone -> [], alone in
    let halved = Array.map paired windows in
    let pairs = List.concat_map fst (Array.to_list halved) and alone = List.concat_map snd (Array.to_list halved) in
    let rows which = Folding.selected x.map (Array.of_list which) in
    let base = rows (List.map snd pairs) and rest = rows alone in
    let difference = Folding.sum ~minus:true (rows (List.map fst pairs)) base in
    let rectified, also = relu graph node difference x.first [ base; rest ] in
    let larger = Folding.sum rectified (List.hd also) in
    let map = Folding.stacked [ larger; List.nth also 1 ] in
    let pair = ref 0 and single = ref (List.length pairs) in
    let next counter = let k = !counter in incr counter; k in
    let windows = Array.map (fun (pairs, alone) ->
        let larger = List.map (fun _ -> next pair) pairs in
        larger @ List.map (fun _ -> next single) alone) halved in
    largest graph node { x with map; first = "" } windows shape
  end
let largest_of_inputs graph node =
  let is_least = node.op = "Min" in
  let first = match List.find_opt (is_value graph) node.inputs with
    | Some name -> Hashtbl.find graph.values name | None -> refuse "does not use the output of the preceding node" in
  let n = size first.shape in
  let part k name =
    let map = match Hashtbl.find_opt graph.values name with
      | Some value ->
        if value.shape <> first.shape then refuse "its inputs are of different shapes";
        value.map
      | None -> Folding.constant graph.chain.width (Operators.broadcast (needed_constant graph node k) first.shape) in
    if is_least then Folding.negated map else map in
  let parts = List.mapi part node.inputs in
  let windows = Array.init n (fun i -> List.mapi (fun k _ -> k * n + i) parts) in
  let x = largest graph node { first with map = Folding.stacked parts } windows first.shape in
  if is_least then { x with map = Folding.negated x.map } else x

(* Piecewise linear functions, written with ReLU. *)
let piecewise_linear graph node = match node.op with
  | "Max" | "Min" -> largest_of_inputs graph node
  | op ->
    let x = value graph node 0 in
    let both_sides below = sum_of_relus graph node x [ x.map, once; Folding.negated x.map, below ] () in
    match op with
    | "Relu" -> sum_of_relus graph node x [ x.map, once ] ()
    | "MaxPool" | "GlobalMaxPool" ->
      let windows, shape = Operators.max_windows node x.shape in
      largest graph node x windows shape
    | "Abs" -> both_sides once
    | "LeakyRelu" ->
      let slope = exactly (-. number node "alpha" (Exact.float32 0.01)) in
      both_sides (fun _ -> slope)
    | "PRelu" ->
      let slopes = broadcast graph node 1 x.shape in
      both_sides (fun k -> opposite slopes.(k))
    | "HardSigmoid" ->
      let alpha = exactly (number node "alpha" (Exact.float32 0.2)) and beta = exactly (number node "beta" 0.5) in
      let line = Folding.shifted (Folding.scaled x.map (fun _ -> alpha)) (fun _ -> beta) in
      clipped graph node { x with map = line } (Some (a_number 0.)) (Some (a_number 1.))
    | _ ->
      let limit k name =
        let stored = constant graph node k in
        if has name node then Some (a_number (number node name 0.)) else stored in
      let least = limit 1 "min" in
      clipped graph node x least (limit 2 "max")

let activation_of node =
  let with_1 activation =
    if number node "alpha" 1. <> 1. then
      refuse ~hint:"use the activation with its default parameters" "alpha is not 1";
    activation in
  match node.op with
  | "Tanh" -> Proved.Tanh
  | "Sigmoid" -> Sigmoid
  | "Softplus" -> Softplus
  | "Elu" | "Celu" -> with_1 Proved.Elu
  | "Swish" -> with_1 Proved.Silu
  | "Selu" ->
    refuse ~hint:"save the state dict, and certify it with --activation selu"
      "uses float32 constants whose product exceeds the slope of SELU"
  | _ ->
    if word node "approximate" "none" <> "none" then
      refuse ~hint:"use the activation with its default parameters" "approximate is not none";
    Gelu
let smooth graph node =
  let x = value graph node 0 in
  let activation = activation_of node in
  let name = layer_name graph x.first in
  let map, _ = with_layer graph node [] (Folding.activated graph.chain activation name x.map) in
  { map; shape = x.shape; first = "" }

(* The rows of each pair in order, the larger one at its second place: max(a, b) = b + relu(a - b) and
   min(a, b) = b - relu(b - a). Rows in no pair are carried. *)
let ordered graph node map first pairs =
  let pairs = Array.of_list pairs in
  let smaller_at = Array.map fst pairs and larger_at = Array.map snd pairs and n = Array.length pairs in
  let place = Array.make (Folding.size map) (-1) in
  Array.iteri (fun k at -> place.(at) <- k) smaller_at;
  Array.iteri (fun k at -> place.(at) <- n + k) larger_at;
  let others = List.filter (fun k -> place.(k) < 0) (List.init (Folding.size map) Fun.id) in
  List.iteri (fun k at -> place.(at) <- 2 * n + k) others;
  let base = Folding.selected map smaller_at and rest = Folding.selected map (Array.of_list others) in
  let difference = Folding.sum ~minus:true (Folding.selected map larger_at) base in
  let both = Folding.stacked [ difference; Folding.negated difference ] in
  match relu graph node both first [ base; rest ] with
  | rectified, [ base; rest ] ->
    let part k = Folding.selected rectified (Array.init n (fun i -> k * n + i)) in
    let larger = Folding.sum base (part 0) and smaller = Folding.sum ~minus:true base (part 1) in
    Folding.selected (Folding.stacked [ smaller; larger; rest ]) place
  | _ -> assert false

let largest_group_with_relu = 8
(* Beside a skip connection, past which the sorting itself is not known. *)
let sorted_with_relu graph node x sorting =
  let n = Folding.size x.map in
  let every condition = List.filter condition (List.init n Fun.id) in
  match sorting with
  | Proved.Halves ->
    ordered graph node x.map x.first (List.map (fun k -> n / 2 + k, k) (every (fun k -> k < n / 2)))
  | Proved.Pairs ->
    let even = every (fun k -> k mod 2 = 0) and odd = every (fun k -> k mod 2 = 1) in
    let pairs = List.map (fun k -> k + 1, k) even in
    Folding.selected (ordered graph node x.map x.first pairs) (Array.of_list (even @ odd))
  | Proved.Groups group ->
    if group > largest_group_with_relu then
      refuse ~hint:"leave the skip connection out, or train with MaxMin or ReLU"
        "sorts groups of more than 8 numbers beside a skip connection";
    (* Neighbours in turn: odd-even transposition sort. *)
    let in_round round k = k mod group + 1 < group && k mod group mod 2 = round mod 2 in
    let step map round = match every (in_round round) with
      | [] -> map
      | firsts ->
        let first = if round = 0 then x.first else "" in
        ordered graph node map first (List.map (fun k -> k, k + 1) firsts) in
    List.fold_left step x.map (List.init group Fun.id)
let sorted graph node =
  let x = value graph node 0 in
  let sorting, shape, which = Operators.sorting (integers graph) node x.shape in
  let map =
    if needed_behind graph node <> [] then sorted_with_relu graph node x sorting
    else
      let name = layer_name graph x.first in
      fst (with_layer graph node [] (Folding.activated graph.chain (Proved.Sorted sorting) name x.map)) in
  { map = Folding.selected map which; shape; first = "" }

let applied graph node (map, shape) weight =
  let x = value graph node (if is_value graph (input node 0) then 0 else 1) in
  { map = Folding.composed map x.map; shape; first = if x.first = "" then weight else x.first }

let rec take_while f = function x :: rest when f x -> x :: take_while f rest | _ -> []
(* Add, Sub, Mul, Div, Neg and Sum, of two values, or of a value and a constant. *)
let elementwise graph node =
  if List.length node.inputs <> 2 && node.op <> "Sum" then refuse "does not have two inputs";
  let base = List.length (take_while (fun name -> not (is_value graph name)) node.inputs) in
  let adds = List.mem node.op [ "Add"; "Sum"; "Sub" ] and minus = node.op = "Sub" in
  let with_other x k =
    if is_value graph (input node k) then begin
      if not adds then refuse "is not an affine function of the network's input";
      let y = value graph node k in
      if y.shape <> x.shape then refuse "its inputs are of different shapes";
      { x with map = Folding.sum ~minus x.map y.map; first = if x.first = "" then y.first else x.first }
    end else begin
      if node.op = "Div" && base > 0 then refuse "divides a constant by a value";
      let numbers = broadcast graph node k x.shape in
      let map =
        if adds then
          let x = if minus && base > 0 then Folding.negated x.map else x.map in
          Folding.shifted ~minus:(minus && base = 0) x (Array.get numbers)
        else if node.op = "Mul" then Folding.scaled x.map (Array.get numbers)
        else if Array.exists (fun n -> n.value = 0.) numbers then refuse "divides by 0"
        else Folding.divided_by x.map numbers in
      { x with map }
    end in
  let others = List.filter (( <> ) base) (List.mapi (fun k _ -> k) node.inputs) in
  List.fold_left with_other (value graph node base) others

let affine graph node =
  let weights k = needed_constant graph node k in
  match node.op with
  | "Gemm" ->
    if List.length node.inputs < 2 || List.length node.inputs > 3 || not (is_value graph (input node 0))
    || input node 1 = "" then refuse "is not the input times weights plus biases";
    let w = weights 1 in
    applied graph node (Operators.gemm node w (constant graph node 2) (value graph node 0).shape) w.name
  | "MatMul" ->
    let weight_is_left = not (is_value graph (input node 0)) in
    let w = weights (if weight_is_left then 0 else 1) in
    let shape = (value graph node (if weight_is_left then 1 else 0)).shape in
    applied graph node (Operators.matmul w ~weight_is_left shape) w.name
  | "Conv" ->
    let w = weights 1 in
    applied graph node (Operators.convolution node w (constant graph node 2) (value graph node 0).shape) w.name
  | "AveragePool" | "GlobalAveragePool" ->
    applied graph node (Operators.average node (value graph node 0).shape) ""
  | "BatchNormalization" ->
    let x = value graph node 0 in
    let factors, amounts = Operators.normalization node (List.map weights [ 1; 2; 3; 4 ]) x.shape in
    { x with map = Folding.shifted (Folding.scaled x.map factors) amounts }
  | "Neg" -> let x = value graph node 0 in { x with map = Folding.negated x.map }
  | _ -> elementwise graph node

(* What rearranges numbers. *)
let layout graph node =
  let x = value graph node 0 and integers = integers graph node in
  let selected (shape, which) = { x with map = Folding.selected x.map which; shape } in
  match node.op with
  | "Flatten" -> { x with shape = Operators.flattened x.shape (whole node "axis" 1) }
  | "Reshape" ->
    let zero_is_zero = number node "allowzero" 0. <> 0. in
    { x with shape = Operators.reshaped x.shape (integers 1 "shape") ~zero_is_zero }
  | "Squeeze" | "Unsqueeze" ->
    { x with shape = Operators.squeezed x.shape (integers 1 "axes") ~adds:(node.op = "Unsqueeze") }
  | "Transpose" -> selected (Operators.transposition x.shape (listed node "perm" []))
  | "Dropout" -> Operators.require_inference ?mode:(constant graph node 2) node; x
  | "Cast" ->
    let kind = whole node "to" 0 in
    if kind <> float32 && kind <> float64 then refuse "casts to a type that is neither float32 nor float64";
    x
  | "Pad" ->
    let filler = match constant graph node 2 with
      | Some { numbers; _ } when numbers <> [||] -> numbers.(0) | _ -> number node "value" 0. in
    let shape, copied = Operators.padding node (integers 1 "pads") ?axes:(constant graph node 3) x.shape in
    let row = function Some k -> x.map.rows.(k) | None -> [] in
    let shift = function Some k -> x.map.shifts.(k) | None -> exactly filler in
    { x with map = { x.map with rows = Array.map row copied; shifts = Array.map shift copied }; shape }
  | "Concat" ->
    let parts = List.mapi (fun k _ -> value graph node k) node.inputs in
    let shape, which = Operators.concatenation (List.map (fun x -> x.shape) parts) (whole node "axis" 0) in
    { (selected (shape, [||])) with map = Folding.selected (Folding.stacked (List.map (fun x -> x.map) parts)) which }
  | _ -> x

let computed graph node =
  let names = inputs_that_count node in
  List.iter (fun name -> if name <> "" && not (is_value graph name || is_stored graph name) then
                refuse "uses \"%s\", which is neither stored nor computed before it" (shown name)) names;
  if not (List.exists (is_value graph) names) then refuse "does not use the output of the preceding node";
  match node.op with
  | "MaxMin" | "PairsMaxMin" | "TopK" -> sorted graph node
  | "Gemm" | "MatMul" | "Conv" | "BatchNormalization" | "AveragePool" | "GlobalAveragePool" | "Add" | "Sub" | "Mul"
  | "Div" | "Neg" | "Sum" -> affine graph node
  | "Identity" | "Dropout" | "Cast" | "Flatten" | "Reshape" | "Squeeze" | "Unsqueeze" | "Transpose" | "Concat"
  | "Pad" -> layout graph node
  | "Relu" | "LeakyRelu" | "PRelu" | "Clip" | "Abs" | "Max" | "Min" | "HardSigmoid" | "MaxPool" | "GlobalMaxPool" ->
    piecewise_linear graph node
  | "Tanh" | "Sigmoid" | "Softplus" | "Elu" | "Celu" | "Selu" | "Gelu" | "Swish" -> smooth graph node
  | "Softmax" | "LogSoftmax" when output node = graph.model.output -> value graph node 0  (* of the logits *)
  | _ -> refuse "%s" operators

let of_integers integers = { name = ""; shape = [ List.length integers ]; kind = int64; numbers = [||]; integers }
(* Of a Constant node, which states it in one of five attributes. *)
let stated_tensor node ~hint =
  let of_floats numbers shape = { name = ""; shape; kind = float32; numbers; integers = [] } in
  let number name = number node name 0. in
  match found "value" node, found "value_floats" node with
  | Some { tensor = Some t; _ }, _ -> t
  | _ when has "value_float" node -> of_floats [| number "value_float" |] []
  | _, Some { floats; _ } -> of_floats floats [ Array.length floats ]
  | _ when has "value_int" node ->
    let x = number "value_int" in
    if not (Float.abs x < 0x1p53) then refuse ~hint "value_int is out of range";
    { (of_integers [ small (Int64.of_float x) ]) with shape = [] }
  | _ when has "value_ints" node -> of_integers (listed node "value_ints" [])
  | _ -> refuse ~hint "holds no tensor"
(* What a node computes from constants, or from the shape of a value. *)
let constant_of graph node =
  let hint = "fold constants: torch.onnx.export(..., do_constant_folding=True)" in
  let first () = needed_constant graph node 0 in
  match node.op with
  | "Constant" -> stated_tensor node ~hint
  | "Identity" -> first ()
  | "Cast" -> Operators.require_exact_cast node (first ()).numbers ~hint; first ()
  | "Shape" ->
    let shape = if is_value graph (input node 0) then (value graph node 0).shape else (first ()).shape in
    of_integers (Operators.sizes_between node shape)
  | "Reshape" when (first ()).numbers <> [||] ->
    let t = first () in
    { t with shape = Operators.reshaped t.shape (integers graph node 1 "shape") ~zero_is_zero:false }
  | ("Reshape" | "Squeeze" | "Unsqueeze" | "Flatten") when (first ()).integers <> [] -> first ()
  | "Transpose" when (first ()).numbers <> [||] ->
    let t = first () in
    let shape, which = Operators.transposition t.shape (listed node "perm" []) in
    { t with shape; numbers = Array.map (Array.get t.numbers) which }
  | "Gather" when (first ()).integers <> [] ->
    let sizes = (first ()).integers in
    of_integers (List.map (fun k -> List.nth sizes (Operators.axis_of k (List.length sizes)))
                   (needed_constant graph node 1).integers)
  | "Concat" when (first ()).integers <> [] ->
    let all = List.concat (List.mapi (fun k _ -> (needed_constant graph node k).integers) node.inputs) in
    if List.length all > 64 then refuse ~hint "its result has too many entries";
    of_integers all
  | _ -> refuse ~hint "is not computed from constants by this reader"
let is_constant graph node = match node.op, node.inputs with
  | "Constant", _ -> true
  | "Shape", [ name ] when is_value graph name -> true
  | _, first :: _ -> first <> "" && List.for_all (fun name -> name = "" || is_stored graph name) node.inputs
  | _, [] -> false
let store graph node =
  let tensor = constant_of graph node and name = output node in
  (* Weights keep their own name through Transpose and the like. *)
  let is_named_anew = List.mem node.op [ "Constant"; "Identity"; "Shape" ] || tensor.name = "" in
  Hashtbl.add graph.model.tensors name (if is_named_anew then { tensor with name } else tensor)

let follow graph node =
  let take_inputs () =
    List.iter (fun name ->
        Hashtbl.replace graph.uses name (count graph name - 1);
        if count graph name = 0 then Hashtbl.remove graph.values name) (inputs_that_count node) in
  if is_constant graph node then begin store graph node; take_inputs () end
  else begin
    let result = computed graph node in
    if not (Folding.is_finite result.map) then raise Not_finite;
    take_inputs ();
    if count graph (output node) > 0 then Hashtbl.replace graph.values (output node) result
  end

(* What a node, or the graph's output, is refused for. *)
let refusing path what work =
  let refuse reason hint = bad_input "%s: %s: %s; %s" path what reason hint in
  try work () with
  | Refused (reason, hint) -> refuse reason hint
  | Folding.Too_large reason -> refuse reason "certify a smaller network, or fold before exporting"
  | Not_finite ->
    refuse "its weights, or their folded values, are not finite"
      "the training has diverged, or the file is damaged: take an earlier checkpoint"

(* The size of the input by the first weights that it reaches. *)
let inputs_by_weights path (model : Onnx_model.t) =
  let rec go current = function
    | [] -> bad_input "%s: the model does not state the size of its input" path
    | node :: rest when List.mem current node.inputs && node.outputs <> [] ->
      let is_first = List.hd node.inputs = current in
      let other = List.nth_opt node.inputs (if is_first then 1 else 0) in
      let weight = Option.bind other (Hashtbl.find_opt model.tensors) in
      (match node.op, weight with
       | ("Gemm" | "MatMul"), Some { shape = [ a; b ]; _ } ->
         let outputs_first = if node.op = "Gemm" then number node "transB" 0. <> 0. else not is_first in
         if outputs_first then b else a
       | _ -> go (output node) rest)
    | _ :: rest -> go current rest in
  go model.input model.nodes
let input_shape path (model : Onnx_model.t) =
  let refuse what = bad_input "%s: the shape of the input %s" path what in
  if List.length model.shape > 8 then refuse "has more than 8 dimensions";
  let shape = match model.shape with [] -> [ 0 ] | 0 :: (_ :: _ as rest) -> 1 :: rest | shape -> shape in
  let shape = match List.length (List.filter (( = ) 0) shape) with
    | 0 -> shape
    | 1 ->
      let limit = Folding.most_numbers in
      let known = Operators.product ~limit (List.filter (( <> ) 0) shape) and inputs = inputs_by_weights path model in
      if known > limit || inputs mod known <> 0 || inputs < known then refuse "does not fit the first node";
      List.map (fun n -> if n = 0 then inputs / known else n) shape
    | _ -> refuse "leaves open more than the size of the batch; export with inputs of a fixed size" in
  if Operators.product ~limit:Operators.most_rows shape > Operators.most_rows then refuse "has more than 2^20 entries";
  shape

let tensors kind (layer : Folding.layer) =
  let outputs = Folding.size layer.map in
  [ { Tensor.tensor = layer.name ^ ".weight"; shape = [ outputs; layer.map.inputs ]; kind;
      numbers = (fun () -> Array.concat (Array.to_list (Folding.rows_of layer))) };
    { Tensor.tensor = layer.name ^ ".bias"; shape = [ outputs ]; kind;
      numbers = (fun () -> Folding.biases_of layer) } ]

let read path bytes ~order =
  let model = Onnx_model.read path bytes in
  let values = Hashtbl.create 16 and uses = Hashtbl.create 64 in
  let graph_of model chain = { model; chain; values; uses; names = Hashtbl.create 16 } in
  (* Stored numbers under all their names, before the groups of nodes that take them are looked for. *)
  let without_values = graph_of model (Folding.start 0) in
  let is_number node = node.op = "Constant" || (node.op = "Identity" && is_constant without_values node) in
  let nodes = List.filter (fun node ->
      not (is_number node && (refusing path ("node " ^ node.label) (fun () -> store without_values node); true)))
      model.nodes in
  let model = { model with nodes } in
  let model = { model with nodes = Onnx_groups.joined model } in
  let shape = input_shape path model in
  let graph = graph_of model (Folding.start (size shape)) in
  Hashtbl.add values model.input { map = Folding.identity (size shape); shape; first = "" };
  List.iter (fun name -> Hashtbl.replace uses name (count graph name + 1))
    (model.output :: List.concat_map inputs_that_count model.nodes);
  List.iter (fun node -> refusing path ("node " ^ node.label) (fun () -> follow graph node)) model.nodes;
  let last = match Hashtbl.find_opt values model.output with
    | Some value -> value | None -> bad_input "%s: the graph's output is not where its nodes end" path in
  if graph.chain.layers = [] && Folding.is_identity last.map then bad_input "%s: has no linear layer" path;
  let layers, between = refusing path "the graph's output" (fun () ->
      Folding.finished graph.chain (layer_name graph last.first) last.map) in
  let is_double = Hashtbl.fold (fun _ (t : tensor) found -> found || t.kind = float64) model.tensors false in
  let kind = if not is_double && List.for_all Folding.holds_float32 layers then "float32" else "float64" in
  let w = Weights.assemble ~path ~sha256:(Sha256.to_hex (Sha256.string bytes)) Layer_order.Evaluation ~order
      (List.concat_map (tensors kind) layers) in
  { w with activations = Some between }

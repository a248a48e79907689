(* ONNX models that are a chain of linear layers with an activation behind each, the last one possibly not, MaxMin and
   GroupSort as exporters write them, in several nodes; and graphs of such layers with skip connections. *)

open Refusal

type stored = { name : string; shape : int list; kind : int; raw : string; integers : int list }
type attribute = { number : float option; word : string; tensor : stored option; listed : int list }
(* `parts`: the nodes that this one stands for. *)
type node = { op : string; inputs : string list; outputs : string list; attributes : (string * attribute) list;
              parts : node list }
(* Column k of the weights takes number `order.(k)` of the layer before; no order: number k. *)
type affine = { weight : stored; transposed : bool; order : int array option; mutable bias : stored option }

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

(* min_int where a number is beyond the range of sizes. *)
let small n = if Int64.compare n (-0x7FFFFFFFL) > 0 && Int64.compare n 0x7FFFFFFFL < 0 then Int64.to_int n else min_int

let int64s path fields =
  let of_raw raw = List.init (String.length raw / 8) (fun k -> small (String.get_int64_le raw (8 * k))) in
  List.concat_map (fun (number, value) -> match number, value with
      | 7, value -> List.map small (Protobuf.integers path value)
      | 9, Protobuf.Bytes raw -> of_raw raw
      | _ -> []) fields

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
  { name; shape; kind; raw; integers = if kind = 7 then int64s path fields else [] }

let attribute path message =
  let fields = Protobuf.fields path message in
  let number = match all 2 fields, all 3 fields with
    | Protobuf.Fixed four :: _, _ when String.length four = 4 -> Some (Int32.float_of_bits (String.get_int32_le four 0))
    | _, Protobuf.Number n :: _ -> Some (Int64.to_float n)
    | _ -> None in
  let tensor = match texts path 5 fields with t :: _ -> Some (tensor path t) | [] -> None in
  let listed = List.concat_map (Protobuf.integers path) (all 8 fields) in
  text path 1 fields, { number; word = text path 4 fields; tensor; listed = List.map small listed }

let node path message =
  let fields = Protobuf.fields path message in
  let domain = text path 7 fields in
  if domain <> "" && domain <> "ai.onnx" then bad_input "%s: a node is of an operator set that cannot be read" path;
  match texts path 2 fields with
  | [] -> bad_input "%s: a node has no output" path
  | outputs -> { op = text path 4 fields; inputs = texts path 1 fields; outputs;
                 attributes = List.map (attribute path) (texts path 5 fields); parts = [] }

let refuse_node path node what = bad_input "%s: node %s: %s" path (shown node.op) what
let output node = List.hd node.outputs
let integer_of node name otherwise = match List.assoc_opt name node.attributes with
  | Some { number = Some x; _ } -> if Float.abs x < 0x1p31 then int_of_float x else min_int
  | Some _ -> 0
  | None -> otherwise

type state = {
  mutable layers : affine list;
  mutable is_activated : bool;
  mutable activations : Proved.activation list;  (* the last one first *)
  mutable shape : int list;  (* of the value; the last size is 0 where the file leaves that of the input open *)
  mutable order : int array option;  (* in which the next layer takes what is sorted, where it is another *)
}

let size shape = List.fold_left ( * ) 1 shape
let last shape = List.nth shape (List.length shape - 1)
let rec but_last = function [] | [ _ ] -> [] | x :: rest -> x :: but_last rest
(* Whether the whole value lies along this axis. *)
let is_last_axis axis shape = (axis = -1 || axis = List.length shape - 1) && size (but_last shape) = 1

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

(* Exporters write SiLU as the product of x and Sigmoid(x), GELU as x (1 + Erf(x / sqrt 2)) 0.5, MaxMin as Split, Max,
   Min and Concat of halves, or as ReduceMax, ReduceMin and Concat of pairs. Each group becomes one node. What else
   takes a value from inside of it takes one that is not known any more, and is refused. *)
let joined op first last parts =
  { op; inputs = [ List.hd first.inputs ]; outputs = last.outputs; attributes = []; parts }
(* Whether a stored number, and the only one of its tensor, is off `wanted` by `error` at most. *)
let holds kept name wanted error = match Hashtbl.find_opt kept name with
  | Some { shape; kind = (1 | 11) as kind; raw; _ } when size shape = 1 ->
    Float.abs (Weights.number_at (if kind = 1 then "float32" else "float64") raw 0 0 -. wanted) <= error
  | _ -> false
(* SiLU and GELU, whose nodes need not follow one another beside skip connections. The last one of a group takes its
   place. *)
let with_smooth kept nodes =
  let ( let* ) = Option.bind in
  let writers = Hashtbl.create 64 and takers = Hashtbl.create 64 in
  List.iter (fun node ->
      List.iter (fun name -> Hashtbl.replace writers name node) node.outputs;
      List.iter (fun name -> Hashtbl.add takers name ()) node.inputs) nodes;
  (* The node that computes a value which one other node takes, and once. *)
  let inner op name = match Hashtbl.find_opt writers name with
    | Some node when node.op = op && List.length (Hashtbl.find_all takers name) = 1 -> Some node
    | _ -> None in
  let some op node found = match node with
    | { inputs = [ a; b ]; outputs = [ _ ]; _ } when node.op = op -> List.find_map found [ a, b; b, a ]
    | _ -> None in
  let when_ condition result = if condition then Some result else None in
  let silu last = some "Mul" last (fun (s, x) ->
      let* sigmoid = inner "Sigmoid" s in
      when_ (sigmoid.inputs = [ x ]) ("Swish", sigmoid, [ s ])) in
  let gelu last = some "Mul" last (fun (p, half) ->
      let* product = when_ (holds kept half 0.5 0.) p in
      let* product = inner "Mul" product in
      some "Mul" product (fun (q, x) ->
          let* sum = inner "Add" q in
          some "Add" sum (fun (r, one) ->
              let* erf = when_ (holds kept one 1. 0.) r in
              let* erf = inner "Erf" erf in
              match erf.inputs with
              | [ from ] ->
                let* quotient = inner "Div" from in
                (match quotient.inputs with
                 | [ divided; root ] when divided = x && holds kept root (sqrt 2.) 1e-7 ->
                   Some ("Gelu", quotient, [ p; q; r; from ])
                 | _ -> None)
              | _ -> None))) in
  let group node = match silu node with Some group -> Some group | None -> gelu node in
  let inside = Hashtbl.create 16 in
  List.iter (fun node ->
      let forget (_, _, names) = List.iter (fun name -> Hashtbl.replace inside name ()) names in
      Option.iter forget (group node)) nodes;
  List.filter_map (fun node ->
      if List.exists (Hashtbl.mem inside) node.outputs then None else match group node with
        | Some (op, first, _) -> Some (joined op first node [])
        | None -> Some node) nodes
let take a b c d = (a = c && b = d) || (a = d && b = c)
let rec with_sorting nodes =
  let joined op first last parts rest = joined op first last parts :: with_sorting rest in
  match nodes with
  | ({ op = "Split"; inputs = _ :: _; outputs = [ p; q ]; _ } as split)
    :: { op = one; inputs = [ a; b ]; outputs = [ c ]; _ } :: { op = two; inputs = [ a'; b' ]; outputs = [ d ]; _ }
    :: ({ op = "Concat"; inputs = [ e; f ]; outputs = [ _ ]; _ } as concat) :: rest
    when p <> q && take a b p q && take a' b' p q
         && ((one = "Max" && two = "Min" && e = c && f = d) || (one = "Min" && two = "Max" && e = d && f = c)) ->
    joined "MaxMin" split concat [ split; concat ] rest
  | ({ op = one; inputs = r :: _; outputs = [ c ]; _ } as first)
    :: ({ op = two; inputs = r' :: _; outputs = [ d ]; _ } as second)
    :: ({ op = "Concat"; inputs = [ e; f ]; outputs = [ _ ]; _ } as concat) :: rest
    when r = r' && ((one = "ReduceMax" && two = "ReduceMin" && e = c && f = d)
                    || (one = "ReduceMin" && two = "ReduceMax" && e = d && f = c)) ->
    joined "PairsMaxMin" first concat [ first; second; concat ] rest
  | node :: rest -> node :: with_sorting rest
  | [] -> []
let with_groups_joined kept nodes = with_sorting (with_smooth kept nodes)

(* "Reshape" and "Flatten": the sizes of the same numbers. *)
let reshaped path stored shape node =
  let refuse what = refuse_node path node what in
  if last shape = 0 then refuse "reshapes what has no known shape";
  let count = size shape in
  let sizes = match node.op, node.inputs with
    | "Flatten", _ ->
      let axis = integer_of node "axis" 1 and rank = List.length shape in
      let axis = if axis < 0 then axis + rank else axis in
      if axis < 0 || axis > rank then refuse "flattens at no axis";
      let front = size (List.filteri (fun k _ -> k < axis) shape) in
      [ front; count / front ]
    | _, [ _; sizes ] when integer_of node "allowzero" 0 = 0 ->
      let kept k n = if n <> 0 then n else match List.nth_opt shape k with
          | Some n -> n | None -> refuse "reshapes to a size that is not there" in
      let sizes = List.mapi kept (stored sizes).integers in
      let known = List.fold_left (fun product n -> if n = -1 then product else
                                     if n < 1 || product > Weights.most_numbers / n
                                     then refuse "reshapes to another size" else product * n) 1 sizes in
      (match List.filter (( = ) (-1)) sizes with
       | [] -> sizes
       | [ _ ] -> List.map (fun n -> if n = -1 then count / known else n) sizes
       | _ -> refuse "leaves two sizes open")
    | _ -> refuse "reshapes to a size of 0" in
  if sizes = [] || size sizes <> count then refuse "reshapes to another size";
  sizes

(* What a node that sorts a layer is, the shape of its result, and the order of its numbers where it is another. *)
let sorting path stored shape node =
  let refuse what = refuse_node path node what in
  let integers node k name = match List.assoc_opt name node.attributes, List.nth_opt node.inputs k with
    | Some { listed; _ }, _ -> listed
    | None, Some input when input <> "" -> (stored input).integers
    | None, _ -> [] in
  let n = last shape and rank = List.length shape in
  match node.op, node.parts with
  | "MaxMin", [ split; concat ] ->
    if not (is_last_axis (integer_of split "axis" 0) shape && is_last_axis (integer_of concat "axis" 0) shape)
    || n mod 2 <> 0 || not (List.mem (integers split 1 "split") [ []; [ n / 2; n / 2 ] ])
    then refuse "is no MaxMin of halves";
    Proved.Halves, shape, None
  | "PairsMaxMin", [ first; second; concat ] ->
    let of_pairs node = integer_of node "keepdims" 1 = 0
                        && List.mem (integers node 1 "axes") [ [ -1 ]; [ rank - 1 ] ] in
    if not (rank >= 2 && n = 2 && of_pairs first && of_pairs second
            && is_last_axis (integer_of concat "axis" 0) (but_last shape))
    then refuse "is no MaxMin of pairs";
    Proved.Pairs, but_last (but_last shape) @ [ 2 * last (but_last shape) ], None
  | _ ->
    let sizes = match List.assoc_opt "k" node.attributes with
      | Some _ -> [ integer_of node "k" 0 ] | None -> integers node 1 "k" in
    if not (List.mem (integer_of node "axis" (-1)) [ -1; rank - 1 ] && sizes = [ n ] && integer_of node "sorted" 1 = 1
            && n >= 2 && n <= 64) then refuse "does not sort groups of 2 to 64 numbers";
    let largest_first k = k - k mod n + n - 1 - k mod n in
    Proved.Groups n, shape,
    if integer_of node "largest" 1 = 0 then None else Some (Array.init (size shape) largest_first)

let stored_by path kept node name = match Hashtbl.find_opt kept name with
  | Some t -> t | None -> refuse_node path node "lacks its weights or biases"
(* Whether the node is a constant, or another name of one, which is stored from now on. *)
let stores path kept node =
  let keep tensor = let name = output node in Hashtbl.add kept name { tensor with name }; true in
  match node.op, node.inputs with
  | "Constant", [] ->
    (match List.assoc_opt "value" node.attributes with
     | Some { tensor = Some t; _ } -> keep t | _ -> refuse_node path node "holds no tensor")
  | "Identity", [ input ] when Hashtbl.mem kept input -> keep (stored_by path kept node input)
  | _ -> false
let require_no_factors path node =
  let number name otherwise = match List.assoc_opt name node.attributes with
    | None -> otherwise | Some { number = Some x; _ } -> x | Some _ -> -1. in
  if number "alpha" 1. <> 1. || number "beta" 1. <> 1. || number "transA" 0. <> 0. then
    refuse_node path node "scales or transposes"
(* Whether y = x W, and not x W'. *)
let is_transposed node = node.op = "MatMul" || integer_of node "transB" 0 = 0
let sizes_of_matrix path node (weight : stored) = match weight.shape with
  | [ a; b ] -> if is_transposed node then a, b else b, a | _ -> refuse_node path node "its weights are no matrix"
let no_operator = "is not Gemm, MatMul of the input with weights, Add, Reshape, Flatten, Identity, MaxMin, TopK or an \
                   activation that is known"

let follow path kept state current node =
  let refuse what = refuse_node path node what in
  let stored = stored_by path kept node in
  let start (weight : stored) =
    if state.layers <> [] && not state.is_activated then refuse "two linear layers without an activation between them";
    let inputs, outputs = sizes_of_matrix path node weight in
    let sizes = but_last state.shape @ [ if last state.shape = 0 then inputs else last state.shape ] in
    if size (but_last sizes) <> 1 || last sizes <> inputs then refuse "takes no single row of numbers that fits";
    state.layers <- { weight; transposed = is_transposed node; order = state.order; bias = None } :: state.layers;
    state.shape <- but_last sizes @ [ outputs ];
    state.is_activated <- false;
    state.order <- None in
  let add_bias (bias : stored) = match state.layers with
    | ({ bias = None; _ } as layer) :: _ when not state.is_activated && size (but_last state.shape) = 1 ->
      layer.bias <- Some (match bias.shape with [ 1; n ] -> { bias with shape = [ n ] } | _ -> bias)
    | _ -> refuse "adds where no layer takes a bias" in
  let activate activation =
    if state.layers = [] || state.is_activated then refuse "does not follow a linear layer";
    state.activations <- activation :: state.activations;
    state.is_activated <- true in
  if node.op <> "TopK" && List.length node.outputs <> 1 then refuse "has not exactly one output";
  if stores path kept node then current
  else begin
    let op = node.op and inputs = node.inputs in
    if List.length (List.filter (( = ) current) inputs) <> 1 then refuse "does not take the value before it once";
    List.iter (fun name -> if name <> current && name <> "" && not (Hashtbl.mem kept name) then
                  refuse "takes what is neither the value before it nor stored") inputs;
    (match op, inputs with
     | "Gemm", (first :: weight :: rest) when first = current && weight <> "" && List.length rest <= 1 ->
       require_no_factors path node;
       start (stored weight);
       (match rest with [ bias ] when bias <> "" -> add_bias (stored bias) | _ -> ())
     | "MatMul", [ first; weight ] when first = current -> start (stored weight)
     | "Add", [ a; b ] -> add_bias (stored (if a = current then b else a))
     | "Identity", [ _ ] -> ()
     | ("Reshape" | "Flatten"), first :: _ when first = current ->
       state.shape <- reshaped path stored state.shape node
     | ("MaxMin" | "PairsMaxMin" | "TopK"), first :: _ when first = current ->
       let sorting, shape, order = sorting path stored state.shape node in
       activate (Proved.Sorted sorting);
       state.shape <- shape;
       state.order <- order
     | _, [ _ ] when activation_of node <> None -> activate (Option.get (activation_of node))
     | _ -> refuse no_operator);
    output node
  end

let layer_name names k weight =
  let name = if String.length weight > 7 && Weights.ends_with ".weight" weight then
      String.sub weight 0 (String.length weight - 7) else weight in
  let rec free name =
    if name <> "" && not (Hashtbl.mem names name) then name
    else free (Printf.sprintf "layer%d%s" (k + 1) (if name = "" then "" else "_" ^ name)) in
  let name = free name in
  Hashtbl.add names name (); name

let declared ?order (tensor : stored) name transposed =
  let kind = match tensor.kind with 1 -> "float32" | 11 -> "float64" | n -> Printf.sprintf "data type %d" n in
  let at k = Weights.number_at kind tensor.raw 0 k in
  let taken k = match order with Some order -> order.(k) | None -> k in
  match tensor.shape with
  | [ rows; columns ] when transposed ->
    let numbers () = Array.init (rows * columns) (fun k -> at (taken (k mod rows) * columns + k / rows)) in
    { Weights.tensor = name; shape = [ columns; rows ]; kind; numbers }
  | [ _; columns ] as shape ->
    let numbers () = Array.init (size shape) (fun k -> at (k - k mod columns + taken (k mod columns))) in
    { Weights.tensor = name; shape; kind; numbers }
  | shape -> { Weights.tensor = name; shape; kind; numbers = (fun () -> Array.init (size shape) at) }

(* Of the graph's input. Without one it is a row of any size; the first size is that of the batch. *)
let input_shape path message =
  let parts number messages = List.concat_map (fun m -> texts path number (Protobuf.fields path m)) messages in
  let sizes = List.map (fun d -> integer path 1 (Protobuf.fields path d))
      (parts 1 (parts 2 (parts 1 (parts 2 [ message ])))) in
  let sizes = match sizes with [] -> [ 1; 0 ] | 0 :: (_ :: _ as rest) -> 1 :: rest | sizes -> sizes in
  let product = List.fold_left (fun product n -> if n < 0 || product * max n 1 > Weights.most_numbers then
                                   Weights.most_numbers + 1 else product * max n 1) 1 sizes in
  if List.length sizes > 8 || product > Weights.most_numbers || List.mem 0 (but_last sizes) then
    bad_input "%s: the shape of the input is unknown or too large" path;
  sizes

(* With skip connections: the layers that Folding makes of the graph, as tensors, and what is between them. *)
let folded path kept nodes input shape outputs =
  let refuse node what = refuse_node path node what in
  let nodes = List.filter (fun node -> not (stores path kept node)) nodes in
  let inputs = match last shape, List.find_opt (fun node -> node.op = "Gemm" || node.op = "MatMul") nodes with
    | 0, Some ({ inputs = _ :: weight :: _; _ } as node) ->
      fst (sizes_of_matrix path node (stored_by path kept node weight))
    | 0, _ -> bad_input "%s: the model does not state the size of its input" path
    | n, _ -> n in
  let shape = but_last shape @ [ inputs ] in
  if size shape > 1 lsl 20 then bad_input "%s: the input has more than 2^20 entries" path;
  let chain, first = Folding.start path (size shape) in
  let values = Hashtbl.create 16 and uses = Hashtbl.create 64 in
  let count name = Option.value (Hashtbl.find_opt uses name) ~default:0 in
  List.iter (fun name -> Hashtbl.replace uses name (count name + 1))
    (List.concat_map (fun node -> node.inputs) nodes @ outputs);
  Hashtbl.add values input (first, shape);
  let numbers node (t : stored) =
    let kind = match t.kind with 1 -> "float32" | 11 -> "float64" | _ -> refuse node "takes numbers of another type" in
    Array.init (size t.shape) (fun k ->
        let x = Weights.number_at kind t.raw 0 k in
        if Float.is_finite x then x else refuse node "a number is not finite") in
  (* Added to a row of n numbers. *)
  let added_to_row node n (t : stored) =
    if List.mem t.shape [ [ n ]; [ 1; n ] ] then numbers node t else refuse node "adds numbers of another shape" in
  let computed node =
    let stored = stored_by path kept node in
    let value name = match Hashtbl.find_opt values name with
      | Some value -> value | None -> refuse node "takes what is neither computed before it nor stored" in
    let is_value = Hashtbl.mem values in
    let linear from weight bias =
      let x, shape = value from and weight = stored weight in
      let inputs, outputs = sizes_of_matrix path node weight in
      if size (but_last shape) <> 1 || last shape <> inputs then refuse node "takes no single row of numbers that fits";
      let w = numbers node weight and transposed = is_transposed node in
      let at i j = if transposed then w.(j * outputs + i) else w.(i * inputs + j) in
      let rows = Array.init outputs (fun i -> Array.init inputs (at i)) in
      Folding.linear chain weight.name rows bias x, but_last shape @ [ outputs ] in
    let outputs_of weight = snd (sizes_of_matrix path node (stored weight)) in
    match node.op, node.inputs with
    | "Gemm", (from :: weight :: rest) when weight <> "" && List.length rest <= 1 ->
      require_no_factors path node;
      let n = outputs_of weight in
      linear from weight (match rest with
          | [ bias ] when bias <> "" -> added_to_row node n (stored bias) | _ -> Array.make n 0.)
    | "MatMul", [ from; weight ] -> linear from weight (Array.make (outputs_of weight) 0.)
    | ("Add" | "Sub"), [ a; b ] when is_value a && is_value b ->
      let (x, shape), (y, other) = value a, value b in
      if shape <> other then refuse node "its inputs are of different shapes";
      Folding.sum chain x (if node.op = "Sub" then Folding.negated y else y), shape
    | ("Add" | "Sub"), [ a; b ] ->
      let x, shape = value (if is_value a then a else b) in
      if size (but_last shape) <> 1 then refuse node "takes no single row of numbers";
      let shifts = added_to_row node (last shape) (stored (if is_value a then b else a)) in
      let constant = { Folding.rows = Array.map (fun _ -> []) shifts; shifts; first = "" } in
      let negated_if condition = if condition then Folding.negated else Fun.id in
      let is_sub = node.op = "Sub" in
      Folding.sum chain (negated_if (is_sub && is_value b) x) (negated_if (is_sub && is_value a) constant), shape
    | "Identity", [ from ] -> value from
    | ("Reshape" | "Flatten"), from :: _ ->
      let x, shape = value from in
      x, reshaped path stored shape node
    | _, [ from ] when activation_of node <> None ->
      let x, shape = value from in
      let is_needed name = count name > List.length (List.filter (( = ) name) node.inputs) in
      let needed = List.sort compare (List.filter is_needed (List.of_seq (Hashtbl.to_seq_keys values))) in
      let y, behind = Folding.activated chain (Option.get (activation_of node)) x
          (List.map (fun name -> name, fst (value name)) needed) in
      List.iter (fun (name, y) -> Hashtbl.replace values name (y, snd (value name))) behind;
      y, shape
    | ("MaxMin" | "PairsMaxMin" | "TopK"), _ -> refuse node "has a skip connection beside it"
    | _ -> refuse node no_operator in
  List.iter (fun node ->
      if List.length node.outputs <> 1 then refuse node "has not exactly one output";
      let result = computed node in
      List.iter (fun name ->
          Hashtbl.replace uses name (count name - 1);
          if count name = 0 then Hashtbl.remove values name) node.inputs;
      if count (output node) > 0 then Hashtbl.replace values (output node) result) nodes;
  let output = match outputs with
    | [ name ] when Hashtbl.mem values name -> fst (Hashtbl.find values name)
    | _ -> bad_input "%s: the graph's output is not where its nodes end" path in
  if chain.layers = [] && output.rows = Folding.identity (size shape) then bad_input "%s: has no linear layer" path;
  let layers, between = Folding.finished chain output in
  let is_double = Hashtbl.fold (fun _ (t : stored) found -> found || t.kind = 11) kept false in
  let kind = if not is_double && chain.is_exact && List.for_all Folding.holds_float32 layers then "float32"
    else "float64" in
  let names = Hashtbl.create 16 in
  let tensors k (layer : Folding.layer) =
    let name = layer_name names k layer.weights and outputs = Array.length layer.map in
    [ { Weights.tensor = name ^ ".weight"; shape = [ outputs; layer.inputs ]; kind; numbers = Folding.dense layer };
      { Weights.tensor = name ^ ".bias"; shape = [ outputs ]; kind; numbers = (fun () -> layer.biases) } ] in
  List.concat (List.mapi tensors layers), between

let require_single_names path names =
  let names = List.filter (( <> ) "") names in
  if List.length (List.sort_uniq compare names) <> List.length names then
    bad_input "%s: two values have the same name" path

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
  let inputs = List.filter (fun m -> not (Hashtbl.mem kept (name_of m))) (texts path 11 graph) in
  let input = match inputs with [ one ] -> one | _ -> bad_input "%s: the graph has not one input" path in
  let nodes = List.map (node path) (texts path 1 graph) in
  if List.length nodes > 10_000 then bad_input "%s: the graph has more than 10000 nodes" path;
  require_single_names path
    (name_of input :: Hashtbl.fold (fun name _ names -> name :: names) kept []
     @ List.concat_map (fun node -> node.outputs) nodes);
  let constants, others = List.partition (fun node -> node.op = "Constant") nodes in
  List.iter (fun node -> ignore (stores path kept node)) constants;
  let others = with_groups_joined kept others and shape = input_shape path input and input = name_of input in
  let outputs = List.map name_of (texts path 12 graph) in
  let assembled = Weights.assemble ~path ~sha256:(Sha256.to_hex (Sha256.string bytes)) Layer_order.Evaluation ~order in
  let taken = List.filter (fun name -> name <> "" && not (Hashtbl.mem kept name))
      (List.concat_map (fun node -> node.inputs) others) in
  if List.length (List.sort_uniq compare taken) < List.length taken then begin
    let tensors, between = folded path kept others input shape outputs in
    { (assembled tensors) with activations = Some between }
  end else begin
    let state = { layers = []; is_activated = false; activations = []; shape; order = None } in
    let end_of_chain = List.fold_left (follow path kept state) input others in
    if outputs <> [ end_of_chain ] then bad_input "%s: the graph's output is not where its chain of nodes ends" path;
    if state.layers = [] then bad_input "%s: has no linear layer" path;
    let names = Hashtbl.create 16 in
    let tensors = List.concat (List.mapi (fun k layer ->
        let name = layer_name names k layer.weight.name in
        declared ?order:layer.order layer.weight (name ^ ".weight") layer.transposed
        :: (match layer.bias with Some b -> [ declared b (name ^ ".bias") false ] | None -> []))
            (List.rev state.layers)) in
    let w = assembled tensors in
    let w = if state.is_activated then Weights.with_identity ?order:state.order w else w in
    { w with activations = Some (List.rev state.activations) }
  end

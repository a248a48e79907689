(* Activations that exporters write in several nodes: SiLU as the product of x and Sigmoid(x), GELU as
   x (1 + Erf(x / sqrt 2)) 0.5, MaxMin as Split, Max, Min and Concat of halves, or as ReduceMax, ReduceMin and Concat
   of pairs. Each group becomes one node, in the place of its last. What else takes a value from inside of it takes one
   that is not known any more, and is refused. *)

open Onnx_model

let take a b c d = (a = c && b = d) || (a = d && b = c)

let joined (model : Onnx_model.t) =
  let ( let* ) = Option.bind in
  let when_ condition result = if condition then Some result else None in
  let writers = Hashtbl.create 64 and takers = Hashtbl.create 64 in
  List.iter (fun node ->
      List.iter (fun name -> Hashtbl.replace writers name node) node.outputs;
      List.iter (fun name -> Hashtbl.add takers name node) node.inputs) model.nodes;
  let uses name = List.length (Hashtbl.find_all takers name) in
  let writer op name = match Hashtbl.find_opt writers name with
    | Some node when node.op = op && name <> model.output -> Some node | _ -> None in
  (* The node that computes a value which one other node takes, and once. *)
  let inner op name = if uses name = 1 then writer op name else None in
  let some op node found = match node with
    | { inputs = [ a; b ]; outputs = [ _ ]; _ } when node.op = op -> List.find_map found [ a, b; b, a ]
    | _ -> None in
  (* Whether a stored number, and the only one of its tensor, is off `wanted` by `error` at most. *)
  let holds name wanted error = match Hashtbl.find_opt model.tensors name with
    | Some { numbers = [| x |]; _ } -> Float.abs (x -. wanted) <= error | _ -> false in
  let silu last = some "Mul" last (fun (s, x) ->
      let* sigmoid = inner "Sigmoid" s in
      when_ (sigmoid.inputs = [ x ]) ("Swish", x, [ s ], [])) in
  let gelu last = some "Mul" last (fun (p, half) ->
      let* product = when_ (holds half 0.5 0.) p in
      let* product = inner "Mul" product in
      some "Mul" product (fun (q, x) ->
          let* sum = inner "Add" q in
          some "Add" sum (fun (r, one) ->
              let* erf = when_ (holds one 1. 0.) r in
              let* erf = inner "Erf" erf in
              match erf.inputs with
              | [ from ] ->
                let* quotient = inner "Div" from in
                (match quotient.inputs with
                 | [ divided; root ] when divided = x && holds root (sqrt 2.) 1e-7 ->
                   Some ("Gelu", x, [ p; q; r; from ], [])
                 | _ -> None)
              | _ -> None))) in
  let halves concat = match concat with
    | { op = "Concat"; inputs = [ c; d ]; _ } ->
      let* larger = inner "Max" c in
      let* smaller = inner "Min" d in
      (match larger.inputs, smaller.inputs with
       | [ a; b ], [ a'; b' ] ->
         let* split = writer "Split" a in
         (match split with
          | { inputs = x :: _; outputs = [ p; q ]; _ } when p <> q && take a b p q && take a' b' p q
                                                       && uses p = 2 && uses q = 2 && q <> model.output ->
            Some ("MaxMin", x, [ p; q; c; d ], [ split; concat ])
          | _ -> None)
       | _ -> None)
    | _ -> None in
  let pairs concat = match concat with
    | { op = "Concat"; inputs = [ c; d ]; _ } ->
      let* larger = inner "ReduceMax" c in
      let* smaller = inner "ReduceMin" d in
      (match larger.inputs, smaller.inputs with
       | x :: _, x' :: _ when x = x' && uses x = 2 && x <> model.output ->
         Some ("PairsMaxMin", x, [ c; d ], [ larger; smaller; concat ])
       | _ -> None)
    | _ -> None in
  let group node = List.find_map (fun found -> found node) [ silu; gelu; halves; pairs ] in
  let inside = Hashtbl.create 16 in
  let groups = List.map (fun node ->
      let group = group node in
      Option.iter (fun (_, _, names, _) -> List.iter (fun name -> Hashtbl.replace inside name ()) names) group;
      node, group) model.nodes in
  List.filter_map (fun (node, group) ->
      if List.exists (Hashtbl.mem inside) node.outputs then None else match group with
        | Some (op, x, _, parts) -> Some { node with op; inputs = [ x ]; attributes = []; parts }
        | None -> Some node) groups

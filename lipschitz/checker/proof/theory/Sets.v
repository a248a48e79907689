(** Chains one after the other, as phi and rho of a deep set are, merged into one. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker.
Import ListNotations.

Notation productD := (product zero add mul).
(** The last stage of phi and the first of rho, which no activation separates, are one. *)
Definition set_stages (phi : list matrixD) (w : matrixD) (rho : list matrixD) (last : matrixD) : list matrixD *
    matrixD :=
  match rho with [] => (phi, productD last w) | v :: rho' => (phi ++ productD v w :: rho', last) end.
Definition outputs (hidden : list matrixD) (n : nat) : nat := length (List.last hidden (repeat [] n)).
(** One function after the other: `p`, then each of `ps`, nothing but an added vector between them. `rs`: of all hidden
  layers. *)
Fixpoint check_parts (rs : list relationD) (p : stack) (ps : list stack) (upper r : dyadic) (t : list dyadic)
    (f : factor) : bool :=
  match ps with
  | [] => check rs (fst p) (snd p) upper r t f
  | q :: ps' =>
      let joined := set_stages (fst p) (snd p) (fst q) (snd q) in
      let n := inputs (fst p) (snd p) in
      (length (hd [] (snd p)) =? outputs (fst p) n)%nat && (inputs (fst joined) (snd joined) =? n)%nat
      && shapes n (fst p) (snd p) && shapes (length (snd p)) (fst q) (snd q)
      && check_parts rs joined ps' upper r t f
  end.

Open Scope R_scope.
Lemma plus_comm u v : plusR u v = plusR v u.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. now rewrite IH, Rplus_comm. Qed.
Lemma plus_assoc u v w : plusR (plusR u v) w = plusR u (plusR v w).
Proof. revert v w. induction u as [|a u IH]; intros [|b v] [|c w]; simpl; auto. now rewrite IH, Rplus_assoc. Qed.
Lemma apply_plus m u v : applyR m (plusR u v) = plusR (applyR m u) (applyR m v).
Proof. induction m as [|r m IH]; simpl; auto. now rewrite IH, dot_plus_r. Qed.
Lemma apply_product a b v : length (hd [] b) = length v ->
  applyR (product 0 Rplus Rmult a b) v = applyR a (applyR b v).
Proof.
  intros H. unfold product, apply at 1. rewrite map_map. apply map_ext. intros row.
  rewrite H, dot_comm. apply dot_columns.
Qed.
Lemma affine_join v c w b s y : length (hd [] w) = length y ->
  affine (product 0 Rplus Rmult v w) (plusR (applyR v (plusR b s)) c) y = affine v c (plusR (affine w b y) s).
Proof. intros H. unfold affine. now rewrite apply_product, (plus_assoc _ b s), !(apply_plus v),
    !plus_assoc by auto. Qed.

(** Through all of the hidden layers. *)
Definition through (hidden : list ((list R -> list R) * layer)) (x : list R) : list R :=
  fold_left (fun h k => fst k (affine (fst (snd k)) (snd (snd k)) h)) hidden x.
Lemma length_through hidden x : Forall (fun k => bias_fits (snd k)) hidden ->
  Forall (fun k => keeps_length (fst k)) hidden -> forall n, length x = n ->
  length (through hidden x) = length (List.last (map weights hidden) (repeat [] n)).
Proof.
  unfold through. intros H. revert x. induction H as [|[f [m b]] hidden Hb H IH]; intros x K n Hn; simpl.
  - now rewrite repeat_length.
  - unfold bias_fits in Hb. simpl in Hb. inversion K as [|? ? Kf K']; subst.
    rewrite (IH _ K' (length m)) by (simpl in Kf; now rewrite Kf, length_affine).
    clear. destruct hidden as [|l hidden]; simpl; [now rewrite repeat_length|].
    revert l. induction hidden as [|k hidden IH]; intros l; simpl; auto.
Qed.
Lemma network_app h1 h2 last x : network (h1 ++ h2) last x = network h2 last (through h1 x).
Proof. unfold through. revert x. induction h1 as [|[f [m b]] h1 IH]; intros x; simpl; auto. Qed.
Lemma network_end h last x : network h last x = affine (fst last) (snd last) (through h x).
Proof. unfold through. revert x. induction h as [|[f [m b]] h IH]; intros x; simpl; auto. Qed.

(** rho(phi(x) + s) as one chain. *)
Definition joined (phi : list ((list R -> list R) * layer)) (w : matrix) (b s : list R)
    (rho : list ((list R -> list R) * layer)) (last : layer) : real_stack :=
  let join (l : layer) := (product 0 Rplus Rmult (fst l) w, plusR (applyR (fst l) (plusR b s)) (snd l)) in
  match rho with [] => (phi, join last) | (f, v) :: rho' => (phi ++ (f, join v) :: rho', last) end.
Lemma network_joined phi w b s rho last x : Forall (fun k => bias_fits (snd k)) phi ->
  Forall (fun k => keeps_length (fst k)) phi ->
  length (hd [] w) = length (List.last (map weights phi) (repeat [] (length x))) ->
  run (joined phi w b s rho last) x = network rho last (plusR (network phi (w, b) x) s).
Proof.
  intros Hp Kp Hw. rewrite <- (length_through phi x Hp Kp _ eq_refl) in Hw. unfold run.
  destruct rho as [|[f [v c]] rho]; simpl.
  - rewrite !network_end. now apply affine_join.
  - rewrite network_app, (network_end phi). simpl. now rewrite affine_join.
Qed.

Definition join (l : real_stack) (s : list R) (k : real_stack) : real_stack := joined (fst l) (fst (snd l))
    (snd (snd l)) s (fst k) (snd k).

Lemma instance_join p l q k s : instance p l -> instance q k ->
  instance (set_stages (fst p) (snd p) (fst q) (snd q)) (join l s k).
Proof.
  destruct p as [phi w], q as [rho last], l as [lp [w' b]], k as [lr last']. unfold instance, join. simpl.
  intros [Hp [Ew Hb]] [Hr Hl]. simpl in Ew, Hb. subst w'.
  assert (forall (v : matrixD) (l : layer), of_matrix v l ->
    of_matrix (productD v w) (product 0 Rplus Rmult (fst l) (realm w), plusR (applyR (fst l) (plusR b s)) (snd l)))
    as L.
  { intros v [v' d] [E Hd]. simpl in E, Hd. subst v'. split; simpl.
    - symmetry. apply (f_product zero add mul 0 Rplus Rmult real real_zero real_add real_mul).
    - change (plusR _ d) with (affine (realm v) d (plusR b s)).
      rewrite length_affine by (now rewrite map_length). unfold product. now rewrite !map_length. }
  destruct Hr as [|v [f v'] rho lr [Hv Kf] Hr]; simpl in *.
  - split; [exact Hp|]. now apply L.
  - split; [|exact Hl]. apply Forall2_app; [exact Hp|]. constructor; [|exact Hr]. split; [now apply L|exact Kf].
Qed.

Lemma along_app h1 h2 r1 r2 x x' : along h1 r1 x x' -> along h2 r2 (through h1 x) (through h1 x') ->
  along (h1 ++ h2) (r1 ++ r2) x x'.
Proof.
  unfold through. revert r1 x x'. induction h1 as [|[f [m b]] h1 IH]; intros [|r r1] x x'; simpl; try tauto.
  intros [H A] B. split; auto.
Qed.
Lemma along_joined phi w b s rho last r1 r2 x x' :
  length (hd [] w) = length (through phi x) -> length (hd [] w) = length (through phi x') ->
  let y := network phi (w, b) x in let y' := network phi (w, b) x' in
  along phi r1 x x' -> along rho r2 (plusR y s) (plusR y' s) -> along (fst (joined phi w b s rho last)) (r1 ++ r2) x x'.
Proof.
  simpl. intros L L' A B. rewrite !(network_end phi) in B. cbn [fst snd] in B.
  destruct rho as [|[f [v c]] rho], r2 as [|r r2]; try contradiction; cbn [joined fst].
  - now rewrite app_nil_r.
  - apply along_app; auto. cbn [fst snd along] in *. now rewrite !affine_join by auto.
Qed.

Lemma run_join p l s k x : instance p l -> length x = inputs (fst p) (snd p) ->
  length (hd [] (snd p)) = outputs (fst p) (inputs (fst p) (snd p)) ->
  length (hd [] (fst (snd l))) = length (through (fst l) x) /\ run (join l s k) x = run k (plusR (run l x) s).
Proof.
  destruct l as [lp [w' b]]. intros [Hp [E Hb]] Hx Hw. simpl in *. subst w'.
  destruct (stages_fit _ _ Hp) as (F & M & K).
  assert (length (hd [] (realm (snd p))) = length (List.last (map weights lp) (repeat [] (length x)))) as L.
  { rewrite M. unfold outputs in Hw.
    assert (length (hd [] (realm (snd p))) = length (hd [] (snd p))) as ->
        by (destruct (snd p); simpl; auto using map_length).
    rewrite Hw, <- Hx. generalize (length x). intros n. clear. induction (fst p) as [|m phi IH]; simpl;
        [now rewrite !repeat_length|].
    destruct phi; simpl in *; [now rewrite map_length | exact IH]. }
  split; [|now apply network_joined]. rewrite L. symmetry. now apply length_through.
Qed.

(** Each of `ks` after a vector has been added to what came before. *)
Fixpoint run_after (ks : list (list R * real_stack)) (y : list R) : list R :=
  match ks with [] => y | (s, k) :: ks' => run_after ks' (run k (plusR y s)) end.

Fixpoint along_after (ks : list (list R * real_stack)) (rs : list (list relationD)) (y y' : list R) : Prop :=
  match ks, rs with
  | (s, k) :: ks', r :: rs' =>
      along (fst k) (real_relations r) (plusR y s) (plusR y' s)
      /\ along_after ks' rs' (run k (plusR y s)) (run k (plusR y' s))
  | [], [] => True
  | _, _ => False
  end.

Theorem check_parts_sound r rs ps p upper rho t f : check_parts (r ++ concat rs) p ps upper rho t f = true ->
  forall l ks, instance p l -> Forall2 (fun q k => instance q (snd k)) ps ks ->
  forall x x', length x = inputs (fst p) (snd p) -> length x' = inputs (fst p) (snd p) ->
  along (fst l) (real_relations r) x x' -> along_after ks rs (run l x) (run l x') ->
  norm (minus (run_after ks (run l x)) (run_after ks (run l x'))) <= real upper * norm (minus x x').
Proof.
  revert r rs p. induction ps as [|q ps IH]; intros r rs p H l ks Hl Hks x x' Hx Hx' A B;
      inversion Hks as [|? [s k] ? ks' Hk Hks']; subst; destruct rs as [|r2 rs]; try contradiction; simpl in *.
  - destruct p. rewrite app_nil_r in H. exact (check_sound _ _ _ _ _ _ _ H l Hl x x' Hx Hx' A).
  - do 3 (apply andb_prop in H; destruct H as [H ?HC]). apply andb_prop in H. destruct H as [HW HI]. apply Nat.eqb_eq in
      HW, HI. destruct B as [B B'].
    destruct (run_join p l s k x Hl Hx HW) as [L E]. destruct (run_join p l s k x' Hl Hx' HW) as [L' E'].
    rewrite <- E, <- E' in *. rewrite app_assoc in HC.
    apply (IH _ _ _ HC (join l s k) ks'); eauto using instance_join; try congruence.
    unfold real_relations. rewrite map_app. destruct l as [phi [w b]], k as [hidden last]. now apply along_joined.
Qed.
